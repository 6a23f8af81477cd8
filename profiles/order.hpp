// The order of a campaign's runs, and of the speeds within each.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compensation/units.hpp"

namespace kphi::profiles {

enum class RunOrderKind : std::uint8_t { listed, shuffled };
/// From first_rpm to last_rpm; from last to first; at random; from first to last and back, the turning point held once.
enum class StepOrderKind : std::uint8_t { up, down, shuffled, up_and_down };

struct Order {
  RunOrderKind runs = RunOrderKind::listed;
  StepOrderKind steps = StepOrderKind::up;
  std::uint64_t seed = 0;                ///< of the shuffling
  bool remount_each_repetition = false;  ///< the occlusion is taken off and mounted again for each run
  bool reference = false;                ///< the session begins and ends with a run without occlusion
};

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

[[nodiscard]] RunOrderKind run_order_from(const std::string& name);
[[nodiscard]] StepOrderKind step_order_from(const std::string& name);
[[nodiscard]] const char* name_of(RunOrderKind kind);
[[nodiscard]] const char* name_of(StepOrderKind kind);
/// "runs shuffled (seed 7), steps up_and_down, remounted for each repetition, reference runs first and last".
[[nodiscard]] std::string to_words(const Order& order);

}  // namespace kphi::profiles
