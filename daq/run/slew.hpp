// A commanded speed that may change only so fast: what feeds back into a supply that takes nothing, and what a
// propeller's nut bears, is limited by it.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/clock.hpp"
#include "compensation/units.hpp"

namespace kphi::daq {

class Slew {
 public:
  /// `rate_rad_s2` > 0; none: at once.
  Slew(RadPerSec from, RadPerSec to, std::optional<double> rate_rad_s2)
      : from_(from), to_(to), lasts_s_(rate_rad_s2 ? std::abs((to - from).value()) / *rate_rad_s2 : 0) {}
  [[nodiscard]] Duration lasts() const { return from_seconds(lasts_s_); }
  /// What to command so long after the begin.
  [[nodiscard]] RadPerSec at(Duration since) const {
    if (!(to_seconds(since) < lasts_s_)) return to_;
    return from_ + (to_ - from_) * (std::max(0.0, to_seconds(since)) / lasts_s_);
  }

 private:
  RadPerSec from_, to_;
  double lasts_s_;
};

}  // namespace kphi::daq
