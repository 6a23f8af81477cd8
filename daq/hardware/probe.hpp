// Probes for `kphi devices`: identity, readings, findings. They switch and set nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/finding.hpp"
#include "drivers/supply/supply.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::daq {

struct SupplyProbe {
  std::optional<supply::Identity> identity;  ///< nullopt: no answer
  std::optional<supply::Reading> reading;
  std::vector<Finding> findings;
  [[nodiscard]] bool answers() const { return identity.has_value(); }
  [[nodiscard]] std::vector<std::string> lines() const;
};

/// Throws ConfigurationError for an invalid URI.
[[nodiscard]] SupplyProbe probe_supply(const profiles::SupplyConfig& config, const Clock& clock);

/// Checks a reading against the bench file.
[[nodiscard]] std::vector<Finding> findings_of(const supply::Identity& identity, const supply::Reading& reading,
                                               const profiles::SupplyConfig& wanted);

struct UsbProbe {
  std::string device;  ///< as a bench file names it: "ambient usb:04d8:00dd:0001", "SCPI scpi-usb:1ab1:0e11"
  bool answers = false;
  std::string words;  ///< identity, with the air of a sensor
  std::vector<Finding> findings;
  [[nodiscard]] std::vector<std::string> lines() const;
};

/// The sensor of a bench file, "usb:04d8:00dd…".
[[nodiscard]] UsbProbe probe_sensor(const std::string& address);

/// All that are plugged in, except those of `known` device names. Never throws; empty without USB.
[[nodiscard]] std::vector<UsbProbe> probe_usb(const std::vector<std::string>& known);

}  // namespace kphi::daq
