// The fit of a whole campaign as a command against a scipy script, in one run, by the CPU time of the fastest of
// several.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "fit/model/identification.hpp"
#include "results/steps_csv.hpp"
#include "test/bench/figures.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/source_dir.hpp"

namespace {

namespace fs = std::filesystem;

double cpu_of_children() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// CPU milliseconds of the fastest of `times` runs of a command; leaves on a failure.
double fastest(const std::string& command, int times) {
  double best = 1e9;
  for (int i = 0; i < times; ++i) {
    const double before = cpu_of_children();
    if (std::system(command.c_str()) != 0) {
      fmt::print(stderr, "failed: {}\n", command);
      std::exit(1);
    }
    best = std::min(best, 1e3 * (cpu_of_children() - before));
  }
  return best;
}

}  // namespace

int main() {
  const fs::path folder = fs::temp_directory_path() / fmt::format("kphi_fit_bench_{}", getpid());
  fs::create_directories(folder);
  kphi::results::write_steps(folder / "steps.csv", kphi::fit::campaign_steps());
  const std::string steps = (folder / "steps.csv").string();
  const std::string peer = fmt::format("/usr/bin/python3 {}/test/bench/fit_peer.py", kphi::test::source_dir());
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  const double ours =
      fastest(fmt::format("{} fit {} --loss huber --no-report >/dev/null 2>&1", KPHI_PROGRAM, steps), 7);
  const double theirs = fastest(fmt::format("{} fit {} >/dev/null", peer, steps), 3);
  fs::remove_all(folder);
  fmt::print("kphi fit {:.1f} ms, scipy {:.1f} ms\n", ours, theirs);
  kphi::bench::at_least(15, theirs / ours, "scipy / kphi fit: 600 rows, robust, covariance (30 hoped for)");
  return theirs / ours >= 15 ? 0 : 1;
}
