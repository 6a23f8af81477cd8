// What the live view shows: sent to every page once, before anything else.
#pragma once

#include <string>
#include <vector>

#include "compensation/units.hpp"
#include "daq/guard/guard_limits.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq::live {

struct Subject {
  bool replay = false;  ///< a recorded run, which cannot be stopped
  std::string name;     ///< of the campaign, or of the file
  std::string propeller;
  double speed_max_rpm = 0;        ///< of the profile: how far the axis of speeds reaches
  Seconds minimum_discard;         ///< at the start of every step, not averaged
  std::vector<GuardLimit> limits;  ///< until a guard publishes its own
};

/// `devices`: their reported limits; nullptr: limits of the files only.
[[nodiscard]] inline Subject subject_of(const profiles::Campaign& campaign, const profiles::BenchConfig& config,
                                        const DeviceLimits* devices = nullptr) {
  const double first = to_rpm(campaign.profile.first), last = to_rpm(campaign.profile.last);
  return {false,
          campaign.name,
          campaign.propeller.name,
          first > last ? first : last,
          campaign.minimum_discard,
          combine_limits(campaign, config, devices)};
}

}  // namespace kphi::daq::live
