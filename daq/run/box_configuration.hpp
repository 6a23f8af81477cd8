// Whether the box is still set as it was when the scale of a run was read.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "drivers/netbox/configuration/changes.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "results/records.hpp"

namespace kphi::daq {

/// `biased`: the box's own bias was taken in between, which shows as a gage bias and is no change.
[[nodiscard]] netbox::Changes changes_since(const netbox::Configuration& before, const netbox::Configuration& after,
                                            bool biased);

/// Reads the box's page and compares. Nothing: it is set as `before`. Otherwise configuration_changed; unusable when
/// the page makes no sense; unreachable when after `attempts` there is still no page, so that nobody knows. `page`
/// throws DeviceError.
[[nodiscard]] std::optional<results::StreamEvent> configuration_event(const netbox::Configuration& before, bool biased,
                                                                      const std::function<std::string()>& page,
                                                                      const std::function<Instant()>& now,
                                                                      int attempts);

}  // namespace kphi::daq
