// The Net Box around a run: the pages kept with it, changes of its configuration, and its own bias.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/finding.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/receive/load.hpp"
#include "results/records.hpp"
#include "results/reduction/zeros.hpp"

namespace kphi::daq {

/// Body of one page of the box's web server, "/netftapi2.xml". Throws DeviceError.
using PageReader = std::function<std::string(const std::string& target)>;

struct CalibrationPage {
  std::string json;  ///< {"netftcalapi.xml?index=0": "<?xml …"}; null for a page that was not read
  std::vector<Finding> findings;
};

/// Of the calibration in use.
[[nodiscard]] CalibrationPage read_calibration_page(const PageReader& page, int calibration);

/// `biased`: the box's own bias was taken in between; its gage bias does not count as a change.
[[nodiscard]] netbox::Changes changes_since(const netbox::Configuration& before, const netbox::Configuration& after,
                                            bool biased);

/// Reads the box's page and compares it with `before`. nullopt: equal. Otherwise configuration_changed; unusable if the
/// page cannot be parsed; unreachable if `attempts` gave no page, so that changes are unknown. `page` throws
/// DeviceError.
[[nodiscard]] std::optional<StreamEvent> configuration_event(const netbox::Configuration& before, bool biased,
                                                             const std::function<std::string()>& page,
                                                             const std::function<Instant()>& now, int attempts);

/// Standard deviation of one sample above which the stand is not at rest: a bias taken then is worthless.
inline constexpr double kNoisyForce = 10 * results::kRestForce;    ///< N
inline constexpr double kNoisyTorque = 10 * results::kRestTorque;  ///< N m

/// Why this axis (0..5 = Fx..Tz) is not at rest: its standard deviation is not below `limit`, or not a number.
[[nodiscard]] std::optional<std::string> noise(const netbox::ZeroMeasurement& zero, std::size_t axis, double limit);
/// Why no bias may be taken: an axis is noisier than that, or no sound sample arrived. nullopt: it may be taken.
[[nodiscard]] std::optional<std::string> unrest(const netbox::ZeroMeasurement& before);
/// Which axis is not within `tolerance` of zero; nullopt if all are.
[[nodiscard]] std::optional<std::string> beyond_zero(const netbox::ZeroMeasurement& after,
                                                     const netbox::BiasTolerance& tolerance = {});

[[nodiscard]] results::BoxBias to_bias(const netbox::ZeroMeasurement& before, const netbox::ZeroMeasurement& after);

}  // namespace kphi::daq
