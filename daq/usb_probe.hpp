// What hangs on this host's USB that a bench can use: sensors of the air and SCPI instruments; who they are, what they
// show, what is wrong. Switches and sets nothing.
#pragma once

#include <string>
#include <vector>

#include "drivers/finding.hpp"

namespace kphi::daq {

struct UsbProbe {
  std::string device;  ///< as a bench file names it: "ambient usb:04d8:00dd:0001", "SCPI scpi-usb:1ab1:0e11"
  bool answers = false;
  std::string words;  ///< who it is; of a sensor also the air
  std::vector<Finding> findings;
  [[nodiscard]] std::vector<std::string> lines() const;
};

/// The sensor of a bench file, "usb:04d8:00dd…".
[[nodiscard]] UsbProbe probe_sensor(const std::string& address);

/// All that are plugged in, but for those of `known` device names. Never throws: a host without USB has none.
[[nodiscard]] std::vector<UsbProbe> probe_usb(const std::vector<std::string>& known);

}  // namespace kphi::daq
