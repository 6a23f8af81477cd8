// What is looked at: told to every page once, before anything else.
#pragma once

#include <string>
#include <vector>

#include "compensation/units.hpp"
#include "daq/live/limit_bars.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq::live {

struct Subject {
  bool replay = false;  ///< a recorded run: nothing can be stopped
  std::string name;     ///< of the campaign, or of the file
  std::string propeller;
  double speed_max_rpm = 0;      ///< of the profile: how far the axis of speeds reaches
  Seconds minimum_discard;       ///< at the start of every step, not averaged
  std::vector<LimitBar> limits;  ///< until a guard tells its own
};

/// `devices`: what they told; nullptr: the limits are those of the files.
[[nodiscard]] inline Subject subject_of(const profiles::Campaign& campaign, const profiles::Bench& place,
                                        const DeviceLimits* devices = nullptr) {
  const double first = to_rpm(campaign.profile.first), last = to_rpm(campaign.profile.last);
  return {false,
          campaign.name,
          campaign.propeller.name,
          first > last ? first : last,
          campaign.minimum_discard,
          limit_bars(combine_limits(campaign, place, devices))};
}

}  // namespace kphi::daq::live
