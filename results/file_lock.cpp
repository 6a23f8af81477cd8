#include "results/file_lock.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "results/file_layer.hpp"

namespace kphi::results {
namespace {

constexpr std::size_t kLongestCommand = 200;

/// The command line as the kernel shows it.
std::string own_command() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::string command{std::istreambuf_iterator<char>(file), {}};
  while (!command.empty() && command.back() == '\0') command.pop_back();
  for (char& c : command) {
    if (c == '\0' || c == '\n') c = ' ';
  }
  return command.size() <= kLongestCommand ? command : command.substr(0, kLongestCommand) + " …";
}

std::string own_words() {
  const auto now = fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()));
  const nlohmann::json words{
      {"pid", ::getpid()}, {"command", own_command()}, {"since", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", now)}};
  return words.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

LockHolder read_holder(int descriptor) {
  std::array<char, 4096> text{};
  const ssize_t n = ::pread(descriptor, text.data(), text.size(), 0);
  const auto words =
      nlohmann::json::parse(text.begin(), text.begin() + std::max<ssize_t>(n, 0), nullptr, /*allow_exceptions=*/false);
  if (!words.is_object()) return {};
  try {
    return {words.value("pid", 0), words.value("command", ""), words.value("since", "")};
  } catch (const nlohmann::json::exception&) {
    return {};
  }
}

/// Opens existing files without O_CREAT: in a sticky folder the kernel would refuse those of other users.
int open_or_create(const std::filesystem::path& path) {
  constexpr int kFlags = O_CLOEXEC | O_NOFOLLOW;
  for (;;) {
    if (const int fd = ::open(path.c_str(), O_RDWR | kFlags); fd >= 0) return fd;
    if (errno == EACCES) return ::open(path.c_str(), O_RDONLY | kFlags);
    if (errno != ENOENT) return -1;
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | kFlags, 0666);
    if (fd >= 0) {
      (void)::fchmod(fd, 0666);  // despite the umask: the next user must be able to lock it
      return fd;
    }
    if (errno != EEXIST) return -1;
  }
}

/// False if the former holder removed the file after it was opened here.
bool is_still_at(int descriptor, const std::filesystem::path& path) {
  struct stat mine {
  }, there{};
  return ::fstat(descriptor, &mine) == 0 && ::stat(path.c_str(), &there) == 0 && mine.st_ino == there.st_ino &&
         mine.st_dev == there.st_dev;
}

bool knows_no_locks(int error) { return error == ENOLCK || error == EOPNOTSUPP || error == EINVAL || error == ENOSYS; }

}  // namespace

std::string LockHolder::words() const {
  if (pid == 0) return "another program";
  return fmt::format("process {} ({}) since {}", pid, command, since_utc);
}

std::optional<FileLock> FileLock::take(const std::filesystem::path& path, LockHolder& holder) {
  for (;;) {
    Descriptor file(open_or_create(path));
    const int fd = file.number();
    if (fd < 0) throw RecordError(failure_text(path.string(), errno));
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
      if (knows_no_locks(errno)) return FileLock(path, std::move(file), false);
      holder = read_holder(fd);
      return std::nullopt;
    }
    if (!is_still_at(fd, path)) continue;
    const std::string words = own_words();
    if (::ftruncate(fd, 0) == 0) (void)!::pwrite(fd, words.data(), words.size(), 0);
    return FileLock(path, std::move(file), true);
  }
}

FileLock::~FileLock() {
  if (file_.number() >= 0) ::unlink(path_.c_str());
}

}  // namespace kphi::results
