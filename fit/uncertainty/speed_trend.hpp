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

/// Speed to which the k of the fit belongs, rad/s (science.md, eq. 25); the fastest one where the estimator gives no
/// such k: with an offset, or weighted otherwise than equally.
[[nodiscard]] double reference_speed(const Identification& identification);

/// Of k with the speed, share per rad/s: one for all φ, the weighted mean of theirs, its u with their scatter (Birge).
/// nullopt where no φ tells one.
[[nodiscard]] std::optional<Estimate> common_trend(std::span<const SpeedDependence> speed);

/// One trend for every φ, the weighted mean of theirs. nullopt unless a test finds it, where it is more
/// than the library flies, and where the estimator gives no k that belongs to one speed: with an offset, or weighted
/// otherwise than equally.
[[nodiscard]] std::optional<SpeedTrend> speed_trend(const Identification& identification,
                                                    std::span<const SpeedDependence> speed);

}  // namespace kphi::fit
