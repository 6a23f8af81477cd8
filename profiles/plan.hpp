// The runs of a campaign, its duration and size, before anything turns.
#pragma once

#include <cstdint>
#include <vector>

#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"

namespace kphi::profiles {

/// One commanded speed of a run.
struct PlannedStep {
  /// 0-based, unique in the run; the same number means the same speed, reached from the same side, in all runs of a
  /// campaign whose order of steps is the same: place in the profile, on the way back n, n + 1, …
  int number = 0;
  RadPerSec speed;
};

/// `run_seed`: this run's own, so that its order depends on no other run.
[[nodiscard]] std::vector<PlannedStep> steps_in_order(const std::vector<RadPerSec>& levels, StepOrderKind kind,
                                                      std::uint64_t run_seed);

struct PlannedRun {
  double occlusion_deg = 0;
  int repetition = 1;                ///< 1-based; negative: a reference run, -1 the session's first, -2 its last
  bool mount = true;                 ///< a person mounts the occlusion before it
  std::vector<PlannedStep> steps{};  ///< in the order in which they are run

  [[nodiscard]] bool is_reference() const { return repetition < 0; }
};

/// From the last step until the rotor is at rest, as a small propeller coasts from its top speed.
inline constexpr Seconds kSpinDown{3.5};

/// Where repetitions is a range: the least that there can be.
struct Plan {
  std::vector<PlannedRun> runs;  ///< in the order in which they are run
  int mountings = 0;             ///< how often a person mounts an occlusion, the first one included
  bool mounts_more = false;      ///< more mountings may follow: repetitions is a range, and each is remounted
  int steps = 0;                 ///< in all runs
  Seconds spinning;              ///< motor on: steps, and ramps between them
  Seconds bench;                 ///< spinning, zeros, biases and spinning down; without mounting and cooling
  std::uint64_t samples = 0;     ///< of the Net Box at the bench's rate, zeros included

  /// The occlusions that a person is asked to mount, in order, degrees.
  [[nodiscard]] std::vector<double> mounting_angles() const;
};

/// The same campaign gives the same plan everywhere. Shuffled, the repetitions of an occlusion stay together after its
/// mounting, unless each is remounted: then all runs are shuffled.
[[nodiscard]] Plan make_plan(const Campaign& campaign, const BenchConfig& bench);

/// Another repetition of an occlusion, beyond those that the campaign plans.
[[nodiscard]] PlannedRun extra_run(const Campaign& campaign, double occlusion_deg, int repetition);

/// Time of all ramps of a run, from standstill on; 0 without a slew limit.
[[nodiscard]] Seconds ramp_time(const StepProfile& profile, const PlannedRun& run);

/// Throws ConfigurationError, naming both files and both values, if the campaign asks for more speed than the
/// bench allows.
void require_within(const Campaign& campaign, const BenchConfig& bench);

}  // namespace kphi::profiles
