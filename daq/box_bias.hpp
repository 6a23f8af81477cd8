// When the box's own bias may be taken, and when it has worked.
#pragma once

#include <optional>
#include <string>

#include "drivers/netbox/bias.hpp"
#include "results/records.hpp"

namespace kphi::daq {

/// Deviation of one record above which nobody stands still: a bias taken there is worthless. Ten times the white noise
/// of the cell.
inline constexpr double kNoisyForce = 0.3;     ///< N
inline constexpr double kNoisyTorque = 0.009;  ///< N m

inline constexpr const char* kBiasNextMove = "let the stand come to rest, keep hands and wind off, and try again";

/// Why no bias may be taken, in words: an axis is noisier than that, or no sound record came. Empty: it may.
[[nodiscard]] std::optional<std::string> unrest(const netbox::ZeroMeasurement& before);
/// Which axis is not within `tolerance` of zero, in words. Empty: all are.
[[nodiscard]] std::optional<std::string> beyond_zero(const netbox::ZeroMeasurement& after,
                                                     const netbox::BiasTolerance& tolerance = {});

[[nodiscard]] results::BoxBias to_bias(const netbox::ZeroMeasurement& before, const netbox::ZeroMeasurement& after);

}  // namespace kphi::daq
