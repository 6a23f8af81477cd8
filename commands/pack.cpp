// `kphi pack`: a campaign as one zip for an archive: an RO-Crate 1.2 with checksums and a README of its own.
#include <fmt/chrono.h>
#include <zip.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/text.hpp"
#include "commands/campaign_summary.hpp"
#include "commands/inputs.hpp"
#include "results/campaign_folder.hpp"
#include "results/digest.hpp"
#include "results/version.hpp"

namespace kphi::commands {
namespace {

namespace fs = std::filesystem;

struct PackRequest {
  std::string folder;
  std::string out;
  std::string licence;
  std::string creator;
  bool json = false;
};

struct PackedFile {
  std::string name;  ///< from the campaign's folder
  std::uintmax_t bytes = 0;
  std::string sha256;
};

constexpr const char* kMetadata = "ro-crate-metadata.json";
constexpr const char* kChecksums = "checksums.sha256";
constexpr const char* kReadme = "README.md";
constexpr const char* kRuns = "runs";

std::string media_type(const fs::path& file) {
  const std::string end = file.extension().string();
  for (const auto& [extension, type] : {std::pair{".h5", "application/x-hdf5"},
                                        {".csv", "text/csv"},
                                        {".yaml", "application/yaml"},
                                        {".jsonl", "application/jsonl"},
                                        {".html", "text/html"},
                                        {".svg", "image/svg+xml"},
                                        {".json", "application/json"}})
    if (end == extension) return type;
  return "text/plain";
}

void require_text(const std::string& name) {
  if (printable(name) == name) return;
  throw DataRejected(printable(name) +
                     ": a name that is no UTF-8 text; rename it: other computers could not unpack it");
}

/// Adds every file but the lock. A link could lead out of the folder; what it stands for belongs in its place.
void add_files(const fs::path& folder, const std::string& prefix, std::vector<PackedFile>& files) {
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = prefix + entry.path().lexically_relative(folder).generic_string();
    if (entry.path().filename() == ".lock") continue;
    require_text(name);
    const fs::file_type type = entry.symlink_status().type();
    if (type == fs::file_type::directory || (type == fs::file_type::symlink && name == kRuns && entry.is_directory()))
      continue;
    if (type != fs::file_type::regular)
      throw DataRejected(entry.path().string() +
                         ": is a link, a pipe or a device; put the file itself into its place, or remove it");
    files.push_back({name, entry.file_size(), results::sha256_of_file(entry.path())});
  }
}

/// By name. The runs may lie on another disk.
std::vector<PackedFile> files_of(const fs::path& folder) {
  std::vector<PackedFile> files;
  add_files(folder, "", files);
  if (fs::is_symlink(folder / kRuns)) add_files(folder / kRuns / "", kRuns + std::string("/"), files);
  std::ranges::sort(files, {}, &PackedFile::name);
  return files;
}

std::string today() {
  return fmt::format("{:%Y-%m-%d}",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
}

bool is_simulated(const CampaignSummary& summary) { return origin_named(summary.origin) == Origin::simulated; }

std::string title_of(const CampaignSummary& summary) {
  return fmt::format("{}hrust of propeller {} over occlusions, campaign {}",
                     is_simulated(summary) ? "Simulated t" : "T", summary.propeller, summary.campaign);
}

/// RO-Crate 1.2, https://w3id.org/ro/crate/1.2.
Json metadata_of(const CampaignSummary& summary, const std::vector<PackedFile>& files, const PackRequest& request) {
  const auto reference = [](const std::string& id) { return Json{{"@id", id}}; };
  Json parts = Json::array(), graph = Json::array();
  for (const PackedFile& file : files) parts.push_back(reference(file.name));
  parts.push_back(reference(kChecksums));
  parts.push_back(reference(kReadme));
  graph.push_back({{"@id", kMetadata},
                   {"@type", "CreativeWork"},
                   {"about", reference("./")},
                   {"conformsTo", reference("https://w3id.org/ro/crate/1.2")}});
  Json root{{"@id", "./"},
            {"@type", "Dataset"},
            {"name", title_of(summary)},
            {"description", fmt::format("Raw samples, step means and fit of {} runs of a {}; {}.", summary.progress(),
                                        is_simulated(summary) ? "simulated propeller test stand, not of a real one"
                                                              : "propeller test stand",
                                        kReadme)},
            {"keywords", summary.origin},
            {"datePublished", today()},
            {"license", reference("#licence")},
            {"hasPart", parts},
            {"mentions", reference("#measurement")}};
  if (!request.creator.empty()) root["creator"] = reference("#creator");
  graph.push_back(root);
  graph.push_back({{"@id", "#licence"},
                   {"@type", "CreativeWork"},
                   {"name", request.licence.empty() ? "No licence stated; ask the creator." : request.licence}});
  if (!request.creator.empty()) graph.push_back({{"@id", "#creator"}, {"@type", "Person"}, {"name", request.creator}});
  graph.push_back({{"@id", "#kphi"}, {"@type", "SoftwareApplication"}, {"name", "kphi"}, {"version", kVersion}});
  graph.push_back({{"@id", "#measurement"},
                   {"@type", "CreateAction"},
                   {"name", is_simulated(summary) ? "Simulation of a propeller test stand by kphi"
                                                  : "Measurement on a propeller test stand"},
                   {"startTime", summary.started_utc},
                   {"instrument", reference("#kphi")},
                   {"object", reference("campaign.yaml")},
                   {"result", reference("./")}});
  for (const PackedFile& file : files)
    graph.push_back({{"@id", file.name},
                     {"@type", "File"},
                     {"name", fs::path(file.name).filename().string()},
                     {"encodingFormat", media_type(file.name)},
                     {"contentSize", std::to_string(file.bytes)},
                     {"sha256", file.sha256}});
  for (const char* name : {kChecksums, kReadme})
    graph.push_back({{"@id", name}, {"@type", "File"}, {"name", name}, {"encodingFormat", "text/plain"}});
  return {{"@context", "https://w3id.org/ro/crate/1.2/context"}, {"@graph", graph}};
}

std::string readme_of(const CampaignSummary& summary) {
  return fmt::format(
      "# {}\n\n"
      "{} {} with kphi: {}.\n"
      "{} of {} steps carry a quality flag. K_T = {} N/(rad/s)^2 (95 %), verdict: {}.\n\n"
      "| file | what it is |\n|---|---|\n"
      "| campaign.yaml, bench.yaml | what was asked, and of which stand |\n"
      "| journal.jsonl | what happened, one checksummed line per event |\n"
      "| runs/*.h5 | raw samples of each run, HDF5; the units are attributes |\n"
      "| steps.csv, means.csv | one row per step; averaged over the repetitions |\n"
      "| coefficients.yaml | K_T, k(phi), their uncertainties |\n"
      "| report.html, figures/ | to look at |\n"
      "| {} | this package in RO-Crate's words |\n\n"
      "    sha256sum -c {}                # is it as it was packed?\n"
      "    python3 -c \"import pandas; print(pandas.read_csv('steps.csv').head())\"\n"
      "    python3 -c \"import h5py, glob; print(list(h5py.File(sorted(glob.glob('runs/*.h5'))[0])['load_cell']))\"\n\n"
      "Every column and attribute carries its unit in its name.\n",
      title_of(summary), is_simulated(summary) ? "SIMULATED" : "Measured", summary.started_utc,
      is_simulated(summary)
          ? "no propeller turned and no load cell measured; a simulator gave the samples of a stand on which a\n"
            "propeller spins through a profile of speeds over occlusions of known angle phi"
          : "a propeller spins through a profile of speeds over occlusions of known angle phi, a six-axis\n"
            "load cell measures the force",
      summary.steps.flagged, summary.steps.steps, summary.coefficient(),
      summary.verdict.empty() ? "not fitted" : summary.verdict, kMetadata, kChecksums);
}

/// A zip that is written as a whole by close(), or not at all.
class Zip {
 public:
  explicit Zip(const std::string& path) : path_(path) {
    int code = 0;
    zip_.reset(zip_open(path.c_str(), ZIP_CREATE | ZIP_EXCL, &code));
    if (!zip_) {
      zip_error_t error;
      zip_error_init_with_code(&error, code);
      const std::string words = zip_error_strerror(&error);
      zip_error_fini(&error);
      throw ConfigurationError(fmt::format("{}: cannot be made: {}; choose another name with --out", path, words));
    }
  }
  void add_file(const fs::path& file, const std::string& name, bool compressed) {
    add(zip_source_file(zip_.get(), file.c_str(), 0, -1), name, compressed);
  }
  /// `text` must live until close().
  void add_text(const std::string& text, const std::string& name) {
    add(zip_source_buffer(zip_.get(), text.data(), text.size(), 0), name, true);
  }
  void close() {
    if (zip_close(zip_.get()) != 0) fail("write");
    (void)zip_.release();
  }
  /// What a written one holds. Throws RecordError.
  [[nodiscard]] static std::vector<std::string> names_in(const std::string& path) {
    int code = 0;
    const std::unique_ptr<zip_t, Discard> zip(zip_open(path.c_str(), ZIP_RDONLY, &code));
    if (!zip) throw RecordError(path + ": cannot be read again");
    std::vector<std::string> names;
    for (zip_int64_t i = 0; i < zip_get_num_entries(zip.get(), 0); ++i)
      names.emplace_back(zip_get_name(zip.get(), static_cast<zip_uint64_t>(i), 0));
    return names;
  }

 private:
  void add(zip_source_t* source, const std::string& name, bool compressed) {
    if (source == nullptr) fail(name);
    const zip_int64_t at = zip_file_add(zip_.get(), name.c_str(), source, ZIP_FL_ENC_UTF_8);
    if (at < 0) {
      zip_source_free(source);
      fail(name);
    }
    (void)zip_set_file_compression(zip_.get(), static_cast<zip_uint64_t>(at),
                                   compressed ? ZIP_CM_DEFLATE : ZIP_CM_STORE, 0);
  }
  [[noreturn]] void fail(const std::string& doing) {
    throw RecordError(fmt::format("{}: {}: {}", path_, doing, zip_strerror(zip_.get())));
  }

  struct Discard {
    void operator()(zip_t* zip) const { zip_discard(zip); }
  };
  std::string path_;
  std::unique_ptr<zip_t, Discard> zip_;
};

ExitCode pack(const PackRequest& asked) {
  const auto folder = results::CampaignFolder::open(asked.folder);
  const results::CampaignVerification verified = results::verify_campaign(folder);
  if (!verified.problems.empty())
    throw DataRejected(
        fmt::format("{}; what is damaged is not packed: kphi verify {}", verified.problems.front(), asked.folder));
  const CampaignSummary summary = summary_of(folder);
  PackRequest request = asked;
  if (request.creator.empty()) request.creator = summary.operator_name;
  const std::string root = fs::absolute(folder.path() / ".").lexically_normal().parent_path().filename().string();
  if (request.out.empty()) request.out = root + ".zip";
  require_text(root);

  const std::vector<PackedFile> files = files_of(folder.path());
  std::string checksums;
  for (const PackedFile& file : files) checksums += fmt::format("{}  {}\n", file.sha256, file.name);
  const std::string metadata = metadata_of(summary, files, request).dump(1) + "\n", readme = readme_of(summary);
  Zip zip(request.out);
  for (const PackedFile& file : files)
    zip.add_file(folder.path() / file.name, root + "/" + file.name, fs::path(file.name).extension() != ".h5");
  zip.add_text(metadata, root + "/" + kMetadata);
  zip.add_text(checksums, root + "/" + kChecksums);
  zip.add_text(readme, root + "/" + kReadme);
  zip.close();

  const std::vector<std::string> packed = Zip::names_in(request.out);
  const auto runs = static_cast<std::size_t>(std::ranges::count_if(packed, [&](const std::string& name) {
    return name.starts_with(root + "/runs/") && results::is_complete_run(fs::path(name).filename().string());
  }));
  if (runs != verified.runs)
    throw RecordError(fmt::format("{}: holds {} runs, {} were verified; pack again", request.out, runs, verified.runs));
  if (asked.json) {
    print_json({{"zip", request.out}, {"files", packed.size()}, {"runs", runs}, {"bytes", fs::file_size(request.out)}});
    return ExitCode::ok;
  }
  fmt::print("{}\n", request.out);
  fmt::print(stderr, "packed        {} runs, verified; {} files, {:.1f} MB\n", runs, packed.size(),
             1e-6 * static_cast<double>(fs::file_size(request.out)));
  if (request.licence.empty())
    fmt::print(stderr, "licence       none stated; archives ask for one: --license CC-BY-4.0\n");
  if (!summary.K_T) fmt::print(stderr, "fit           none in it; fit first: kphi fit {}\n", asked.folder);
  return ExitCode::ok;
}

}  // namespace

void add_pack(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] =
      add_verb<PackRequest>(program, exit_code, "pack", "pack a campaign into one zip for an archive (RO-Crate)",
                            "kphi pack results/<folder> --license CC-BY-4.0 --creator \"A. Name\"", pack);
  add_argument(command, "DIR", request.folder, "campaign folder")->check(kExistingFolder);
  add_value(command, "--out", "FILE", request.out,
            "zip to write (default: the folder's name, here); it must not exist");
  add_value(command, "--license", "NAME", request.licence, "under which others may use the data, such as CC-BY-4.0");
  add_value(command, "--creator", "NAME", request.creator, "who measured (default: the campaign's operator)");
  command.add_flag("--json", request.json, "print one JSON object");
}

}  // namespace kphi::commands
