// Probes this computer's USB for devices that a bench can use, air sensors and SCPI instruments: identity, readings,
// findings. Switches and sets nothing.
#pragma once

#include <string>
#include <vector>

#include "base/finding.hpp"

namespace kphi::daq {

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
