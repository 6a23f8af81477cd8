// What it costs to import a long log: `kphi import` of five million rows of a stand's CSV, with the table of steps that
// it writes, against reading the same file by pandas' C reader, both as commands, in turn, files in the page cache.
// Usage: kphi_import_bench [rows [pairs]].
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "base/random.hpp"
#include "compensation/units.hpp"
#include "results/file_layer.hpp"
#include "test/bench/command_cost.hpp"
#include "test/bench/figures.hpp"

namespace {

using namespace kphi;
namespace fs = std::filesystem;

/// A ramp and back of a Series 1780 at 25 Hz, with the columns that such a log has.
void write_log(const fs::path& path, std::size_t rows) {
  Random random(1);
  results::ReplacedFile file(path);
  std::string text =
      "Time (s),ESC (µs),Servo (µs),Torque (N·m),Thrust (N),Voltage (V),Current (A),Motor Optical Speed (RPM),"
      "Electrical Power (W),App message\n";
  for (std::size_t i = 0; i < rows; ++i) {
    const double share = 1 - std::abs(2 * static_cast<double>(i) / static_cast<double>(rows) - 1);
    const double rpm = 1000 + 9000 * share, omega = from_rpm(rpm).value(), amps = 20 * share * share;
    const double thrust = 3e-5 * omega * omega + 0.02 * random.normal();
    text += fmt::format("{:.4f},{:.2f},,{},{},{:.6f},{:.6f},{:.0f},{:.6f},\n", 0.04 * static_cast<double>(i),
                        1000 + 900 * share, 0.01 * thrust, thrust, 48 - amps / 40, amps, rpm, amps * 48);
    if (text.size() < 1u << 20) continue;
    file.append(text);
    text.clear();
  }
  file.append(text);
  file.finish();
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t rows = argc > 1 && std::atoi(argv[1]) > 0 ? std::strtoul(argv[1], nullptr, 10) : 5'000'000;
  const int pairs = argc > 2 ? std::atoi(argv[2]) : 3;
  const fs::path folder = fs::temp_directory_path() / fmt::format("kphi_import_bench_{}", getpid());
  fs::create_directories(folder);
  const std::string log = (folder / "log.csv").string();
  write_log(log, rows);
  fmt::print("{} rows, {:.0f} MB\n", rows, 1e-6 * static_cast<double>(fs::file_size(log)));
  std::vector<double> ratios;
  double memory_mb = 0;
  bool well = true;
  for (int pair = 0; pair < pairs && well; ++pair) {
    const bench::Cost theirs = bench::cost_of(
        "/dev/null", {"/usr/bin/python3", "-c",
                      "import sys, pandas; t = pandas.read_csv(sys.argv[1], engine='c'); print(len(t))", log});
    const bench::Cost ours =
        bench::cost_of("/dev/null", {KPHI_PROGRAM, "import", log, "--out", (folder / "out").string()});
    well = theirs.code == 0 && ours.code == 0;
    fmt::print("kphi {:.2f} s ({:.2f} s of CPU, {:.0f} MB), pandas {:.2f} s ({:.2f} s, {:.0f} MB)\n", ours.wall_s,
               ours.cpu_s, ours.memory_mb, theirs.wall_s, theirs.cpu_s, theirs.memory_mb);
    ratios.push_back(theirs.wall_s / ours.wall_s);
    memory_mb = std::max(memory_mb, ours.memory_mb);
  }
  fs::remove_all(folder);
  if (!well) return 1;
  std::ranges::sort(ratios);
  bench::at_least(1, ratios[ratios.size() / 2], "pandas' C reader / kphi import, with its table of steps: wall time");
  bench::at_most(1, memory_mb / 1000, "memory of kphi import / 1 GB");
  return 0;
}
