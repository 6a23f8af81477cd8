#include "fit/report/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

extern char** environ;

namespace kphi::fit {
namespace {

constexpr const char* kMissing =
    "gnuplot is not installed; `apt install gnuplot-nox` and `kphi report` draws the figures";
constexpr std::size_t kMessageMax = 400;

struct Pipe {
  int read_end = -1;
  int write_end = -1;
  Pipe() {
    std::array<int, 2> ends{-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) == 0) {
      read_end = ends[0];
      write_end = ends[1];
    }
  }
  ~Pipe() {
    close_write();
    if (read_end >= 0) ::close(read_end);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_write() {
    if (write_end >= 0) ::close(write_end);
    write_end = -1;
  }
};

struct FileActions {
  posix_spawn_file_actions_t actions;
  FileActions() { posix_spawn_file_actions_init(&actions); }
  ~FileActions() { posix_spawn_file_actions_destroy(&actions); }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;
};

/// Signals that this program may ignore, and a child must not.
struct DefaultSignals {
  posix_spawnattr_t attributes;
  DefaultSignals() {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGPIPE, SIGXFSZ}) sigaddset(&signals, signal);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setsigdefault(&attributes, &signals);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  }
  ~DefaultSignals() { posix_spawnattr_destroy(&attributes); }
  DefaultSignals(const DefaultSignals&) = delete;
  DefaultSignals& operator=(const DefaultSignals&) = delete;
};

/// Everything until the writer closes its end; only the beginning is kept.
std::string read_all(int descriptor) {
  std::string text;
  std::array<char, 512> buffer{};
  for (;;) {
    const ssize_t n = ::read(descriptor, buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return text;
    if (text.size() < kMessageMax) text.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

int wait_for(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

GnuplotOutcome draw(const std::filesystem::path& script, const std::filesystem::path& svg, const std::string& program) {
  Pipe complaints;
  FileActions files;
  posix_spawn_file_actions_addopen(&files.actions, STDIN_FILENO, script.c_str(), O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files.actions, STDOUT_FILENO, svg.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (complaints.write_end >= 0) posix_spawn_file_actions_adddup2(&files.actions, complaints.write_end, STDERR_FILENO);

  std::string name = program, settings = "--default-settings", from_stdin = "-";
  std::array<char*, 4> arguments{name.data(), settings.data(), from_stdin.data(), nullptr};
  pid_t child = -1;
  const DefaultSignals signals;
  const int error =
      ::posix_spawnp(&child, program.c_str(), &files.actions, &signals.attributes, arguments.data(), environ);
  std::error_code ignored;
  if (error != 0) {
    std::filesystem::remove(svg, ignored);
    if (error == ENOENT) return {false, kMissing};
    return {false, fmt::format("{} did not start: {}", program, std::strerror(error))};
  }
  complaints.close_write();
  const std::string message = complaints.read_end >= 0 ? read_all(complaints.read_end) : "";
  const int status = wait_for(child);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && std::filesystem::file_size(svg, ignored) > 0) return {true, ""};
  std::filesystem::remove(svg, ignored);
  return {false, fmt::format("{} failed on {}: {}", program, script.string(), message)};
}

}  // namespace kphi::fit
