#include "results/disk_trial.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <string_view>
#include <system_error>

#include "results/file_lock.hpp"

namespace kphi::results {
namespace {

/// Everything in it, however the trial ends.
struct Removed {
  std::filesystem::path folder;
  ~Removed() {
    std::error_code none;
    std::filesystem::remove_all(folder, none);
  }
};

void write_file(const std::filesystem::path& path, FileLayer& files) {
  constexpr std::string_view kText = "kphi tries this disk\n";
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.number() < 0) throw std::system_error(errno, std::generic_category(), "create a file");
  files.reserve(file.number(), 0, kText.size());
  write_all(file.number(), kText);
  files.sync_data(file.number());
}

std::vector<Finding> refused(const std::filesystem::path& parent, const std::string& why,
                             const std::string& next = "choose another folder with --out") {
  return {{Severity::fault, fmt::format("{}: no run can be kept here: {}", parent.string(), why), next}};
}

/// As a run becomes a finished one.
std::vector<Finding> finish_file(const std::filesystem::path& folder, FileLayer& files) {
  std::vector<Finding> findings;
  const std::filesystem::path part = folder / "run.h5.part", run = folder / "run.h5", table = folder / "steps.csv";
  write_file(part, files);
  if (!files.make_read_only(part))
    findings.push_back({Severity::warning, folder.parent_path().string() + ": this disk cannot make a file read-only",
                        "finished runs are recorded, and stay writable; their SHA-256 shows a change"});
  files.rename(part, run);
  if (!files.sync_folder(folder))
    findings.push_back({Severity::warning, folder.parent_path().string() + ": this disk cannot sync a folder",
                        "runs are recorded; after a power cut the last one may be missing"});
  write_text(table, "a\n", files);
  write_text(table, "b\n", files);
  if (read_text(table) != "b\n" || !std::filesystem::exists(run))
    throw std::system_error(EIO, std::generic_category(), "read back");
  return findings;
}

}  // namespace

Finding no_lock(const std::filesystem::path& folder) {
  return {Severity::warning, folder.string() + ": this disk gives no locks, as some network drives do",
          "nothing keeps a second kphi from writing into the same campaign: start only one; reading is not affected"};
}

std::vector<Finding> try_disk(const std::filesystem::path& parent, FileLayer& files) {
  const Removed trial{parent / fmt::format(".kphi-trial-{}", ::getpid())};
  try {
    std::filesystem::create_directory(trial.folder);
    std::vector<Finding> findings = finish_file(trial.folder, files);
    LockHolder holder;
    if (const auto lock = FileLock::take(trial.folder / ".lock", holder); lock && !lock->holds())
      findings.push_back(no_lock(parent));
    return findings;
  } catch (const std::filesystem::filesystem_error& error) {
    return refused(parent, error.code().message());  // its own words name every path twice
  } catch (const std::system_error& error) {
    return refused(parent, error.what());
  } catch (const RecordError& error) {
    return refused(parent, error.what(), "");  // it says what to do
  }
}

}  // namespace kphi::results
