// When the box's own bias may be taken, and when it has worked.
#pragma once

#include <optional>
#include <string>

#include "drivers/netbox/receive/bias.hpp"
#include "results/records.hpp"
#include "results/reduction/zeros.hpp"

namespace kphi::daq {

/// Deviation of one record above which nobody stands still: a bias taken there is worthless.
inline constexpr double kNoisyForce = 10 * results::kRestForce;    ///< N
inline constexpr double kNoisyTorque = 10 * results::kRestTorque;  ///< N m

/// Why no bias may be taken, in words: an axis is noisier than that, or no sound record came. Empty: it may.
[[nodiscard]] std::optional<std::string> unrest(const netbox::ZeroMeasurement& before);
/// Which axis is not within `tolerance` of zero, in words. Empty: all are.
[[nodiscard]] std::optional<std::string> beyond_zero(const netbox::ZeroMeasurement& after,
                                                     const netbox::BiasTolerance& tolerance = {});

[[nodiscard]] results::BoxBias to_bias(const netbox::ZeroMeasurement& before, const netbox::ZeroMeasurement& after);

}  // namespace kphi::daq
