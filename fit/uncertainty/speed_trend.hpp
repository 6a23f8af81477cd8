// How k changes with the speed at whatever φ, for the flight: k(φ, ω) = k(φ) (1 + share (ω − reference)).
#pragma once

#include <optional>
#include <span>

#include "fit/uncertainty/speed_dependence.hpp"

namespace kphi::fit {

struct SpeedTrend {
  Estimate per_rad_s;          ///< share of k per rad/s; u with the scatter between the occlusions
  double reference_rad_s = 0;  ///< where k is the k of the fit
};

/// One trend for every φ, the weighted mean of theirs. nullopt unless a test finds it, where it is more
/// than the library flies, and where the estimator gives no k that belongs to one speed: with an offset, or weighted
/// otherwise than equally.
[[nodiscard]] std::optional<SpeedTrend> speed_trend(const Identification& identification,
                                                    std::span<const SpeedDependence> speed);

}  // namespace kphi::fit
