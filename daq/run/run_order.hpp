// What one run must do, and the confirmation that unlocks the motor for it.
#pragma once

#include <filesystem>

#include "daq/run/steering.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "profiles/plan.hpp"

namespace kphi::daq {

/// An operator has confirmed that this occlusion is mounted. Only an Operator can make one, and a run cannot be ordered
/// without it.
class MountConfirmation {
 public:
  [[nodiscard]] double occlusion_deg() const { return occlusion_deg_; }

 private:
  friend class Operator;
  explicit MountConfirmation(double occlusion_deg) : occlusion_deg_(occlusion_deg) {}
  double occlusion_deg_;
};

struct RunOrder {
  const profiles::Campaign& campaign;
  const profiles::BenchConfig& config;
  MountConfirmation mounted;         ///< unlocks the motor
  profiles::PlannedRun planned;      ///< may have fewer steps than in the plan
  double run_bench_s = 0;            ///< this run is expected to take
  bool all_steps = true;             ///< ... if no step ends before its time and none is left out
  double later_bench_s = 0;          ///< the runs of the campaign after it
  std::filesystem::path file;        ///< final path
  Steering* steering = nullptr;      ///< sets the speeds instead of the planned steps
  int run = 0;                       ///< 1-based number in the campaign; 0: alone
  int runs = 0;                      ///< of the campaign
  std::uint64_t samples_before = 0;  ///< in its runs before this one
};

}  // namespace kphi::daq
