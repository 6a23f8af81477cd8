// What it costs to turn a recorded campaign into step means again: `kphi replay` against the same by numpy and h5py
// (replay_peer.py), both as commands with all that their start takes, interleaved, files in the page cache. kphi takes
// all processors, numpy one; the CPU time of both is compared, too. First that both say the same.
// Usage: kphi_replay_bench [runs [pairs]]; 15 runs are 9.1 million samples.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <vector>

#include "results/campaign_folder.hpp"
#include "results/reduction/reduction.hpp"
#include "results/steps_csv.hpp"
#include "test/bench/command_cost.hpp"
#include "test/bench/figures.hpp"
#include "test/results/synthetic_run.hpp"
#include "test/source_dir.hpp"

namespace {

using namespace kphi;
using bench::Cost;
using bench::cost_of;
using results::CampaignFolder;
using results::StepMean;

/// The paper's run: 40 steps of 2 s at 7 kHz.
results::RunRecording paper_run(int repetition) {
  results::test::Truth truth;
  truth.rate_hz = 7000;
  truth.ft_stride = 1;
  truth.speeds.clear();
  for (int i = 0; i < 40; ++i) truth.speeds.push_back((100 + 19000.0 * i / 39) * M_PI / 30);
  truth.k = 1.55e-6;
  truth.zero_s = 2;
  truth.noise_n = 0.025;
  truth.correlated_n = 0.005;
  truth.speed_noise_rad_s = 0.2;
  truth.thrust_delay_s = 0.04;
  truth.reading_phase_s = 0.007;
  truth.records_per_datagram = 40;
  truth.seed = static_cast<std::uint64_t>(repetition);
  results::RunRecording run = results::test::make_run(truth);
  run.header.repetition = repetition;
  return run;
}

std::size_t make_campaign(const CampaignFolder& folder, int runs, std::vector<StepMean>& steps) {
  std::size_t samples = 0;
  results::Journal journal(folder.journal());
  for (int repetition = 1; repetition <= runs; ++repetition) {
    const results::RunRecording run = paper_run(repetition);
    const auto file = folder.run("5x3", 90, repetition);
    const results::RunDigests digests = results::test::write_run(file, run);
    journal.append(results::kRunAccepted,
                   {{"file", "runs/" + file.filename().string()},
                    {"sha256", digests.sha256},
                    {"contents_xxh128", digests.contents_xxh128}},
                   0, "");
    const auto of_run = results::reduce(run);
    steps.insert(steps.end(), of_run.begin(), of_run.end());
    samples += run.load_cell.size();
  }
  results::write_steps(folder.steps(), steps);
  return samples;
}

/// Largest relative difference of thrust between the two, over the steps; infinite when the peer has not as many.
double difference(const std::vector<StepMean>& steps, const std::string& peer_csv) {
  std::stringstream text(peer_csv);
  std::string line;
  std::getline(text, line);
  double largest = 0;
  std::size_t i = 0;
  for (; std::getline(text, line) && i < steps.size(); ++i) {
    double speed = 0, thrust = 0;
    std::sscanf(line.c_str(), "%lf,%lf", &speed, &thrust);
    if (steps[i].thrust_n > 0.1) {
      largest =
          std::max({largest, std::abs(thrust / steps[i].thrust_n - 1), std::abs(speed / steps[i].speed_rad_s - 1)});
    }
  }
  return i == steps.size() ? largest : INFINITY;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 && std::atoi(argv[1]) > 0 ? std::atoi(argv[1]) : 15;
  const int pairs = argc > 2 ? std::atoi(argv[2]) : 7;
  const results::test::TemporaryFolder config;
  const auto folder = CampaignFolder::create(config.path(), "bench", "replay");
  std::vector<StepMean> steps;
  const std::size_t samples = make_campaign(folder, runs, steps);
  const std::string ours = (config.path() / "ours.csv").string(), theirs = (config.path() / "theirs.csv").string();
  std::vector<double> wall, cpu;
  Cost a, b;
  for (int i = 0; i < pairs; ++i) {
    a = cost_of(ours, {KPHI_PROGRAM, "replay", "--csv", folder.path()});
    b = cost_of(theirs, {"/usr/bin/python3", kphi::test::source_dir() + "/test/bench/replay_peer.py", folder.path()});
    if (b.code != 0) {
      fmt::print("replay: the peer did not run (python3-numpy, python3-h5py?)\n");
      return 1;
    }
    wall.push_back(b.wall_s / a.wall_s);
    cpu.push_back(b.cpu_s / a.cpu_s);
  }
  const bool same = a.code == 0 && results::read_text(ours) == results::read_text(folder.steps());
  fmt::print(
      "replay of {} samples ({} runs): step means byte-identical: {}; last pair {:.2f} s / {:.2f} s, worst {:.1f}; "
      "thrust and speed differ from numpy's by {:.1e} at most\n",
      samples, runs, same ? "yes" : "NO", b.wall_s, a.wall_s, *std::min_element(wall.begin(), wall.end()),
      difference(steps, results::read_text(theirs)));
  bench::at_least(10, median(wall), "replay of a campaign: numpy + h5py / kphi, time (median of the pairs)");
  bench::compared(median(cpu), "replay of a campaign: numpy + h5py / kphi, CPU of all threads");
  return same ? 0 : 1;
}
