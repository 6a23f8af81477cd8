#include "fit/report/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "base/number.hpp"
#include "results/file_layer.hpp"

extern char** environ;

namespace kphi::fit {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMissing =
    "gnuplot is not installed; `apt install gnuplot-nox`, then `kphi report` draws the figures";
constexpr std::size_t kMessageMax = 400;

constexpr Mark kMarks[] = {{"#0072B2", 7},  {"#D55E00", 5},  {"#009E73", 9}, {"#CC79A7", 13},
                           {"#E69F00", 11}, {"#56B4E9", 15}, {"#444444", 6}};

/// How the child begins: its three streams, and default actions for signals that this program may ignore.
struct SpawnSettings {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  SpawnSettings(const fs::path& in, const fs::path& out, const fs::path& errors) {
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, in.c_str(), O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGPIPE, SIGXFSZ}) sigaddset(&signals, signal);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setsigdefault(&attributes, &signals);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
};

/// Reads a short file and removes it.
std::string take_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(file), {});
  std::error_code ignored;
  fs::remove(path, ignored);
  return text.substr(0, kMessageMax);
}

int wait_for(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

std::string draw(const fs::path& script, const fs::path& svg, const std::string& program) {
  const fs::path errors = fs::path(svg).replace_extension(".err");
  const SpawnSettings settings(script, svg, errors);
  std::string name = program, plain = "--default-settings", from_stdin = "-";
  std::array<char*, 4> arguments{name.data(), plain.data(), from_stdin.data(), nullptr};
  pid_t child = -1;
  const int error =
      ::posix_spawnp(&child, program.c_str(), &settings.files, &settings.attributes, arguments.data(), environ);
  const int status = error == 0 ? wait_for(child) : 0;
  const std::string message = take_text(errors);
  std::error_code ignored;
  if (error == 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0 && fs::file_size(svg, ignored) > 0) return {};
  fs::remove(svg, ignored);
  if (error == ENOENT) return kMissing;
  if (error != 0) return fmt::format("cannot start {}: {}", program, std::strerror(error));
  return fmt::format("{} failed on {}: {}", program, script.string(), message);
}

Figures draw(const std::vector<Figure>& wanted, const fs::path& folder, const std::string& gnuplot) {
  std::error_code error;
  fs::create_directories(folder, error);  // a failure shows at the first file
  Figures figures;
  results::MemoryOnlySync files;  // can be drawn again at any time from steps.csv
  for (const Figure& figure : wanted) {
    const fs::path script = folder / (figure.name + ".gp"), svg = folder / (figure.name + ".svg");
    results::write_text(script, figure.script, files);
    results::write_text(folder / (figure.name + ".csv"), figure.csv, files);
    figures.skipped = draw(script, svg, gnuplot);
    if (!figures.skipped.empty()) break;
    figures.drawn.push_back({figure.caption, svg});
  }
  return figures;
}

Mark mark(std::size_t i) { return kMarks[i % std::size(kMarks)]; }

std::string figure_head(int height, int width) {
  return fmt::format(
      "set terminal svg size {},{} noenhanced font 'Helvetica,Arial,sans-serif,14' linewidth 1.2 background "
      "'#ffffff'\n"
      "set encoding utf8\nset minussign\n"
      "set border 3 lc rgb '#777777'\n"
      "set tics nomirror out scale 0.6 textcolor rgb '#333333'\n"
      "set grid ytics lc rgb '#e4e4e4' lt 1 lw 0.8\n"
      "set key opaque fillcolor rgb '#ffffff' noenhanced\n",
      width, height);
}

std::string data_block(const std::string& name, const std::string& rows) {
  return fmt::format("${} << EOD\n{}EOD\n", name, rows);
}

std::string csv_cell(double value) { return shortest(value); }
std::string csv_cell(std::string_view text) { return std::string(text); }

std::string plot(const std::vector<std::string>& curves) {
  return fmt::format("plot \\\n  {}\n", fmt::join(curves, ", \\\n  "));
}

}  // namespace kphi::fit
