// What was asked of a device and did not happen. Malformed bytes are no errors, they are counted.
#pragma once

#include <stdexcept>
#include <string>

namespace kphi {

/// Names the device ("Net Box 192.168.1.1"), the operation ("read configuration"), the cause, and the next move.
class DeviceError : public std::runtime_error {
 public:
  DeviceError(const std::string& device, const std::string& operation, const std::string& cause,
              const std::string& next_move = {})
      : std::runtime_error(device + ": " + operation + ": " + cause + (next_move.empty() ? "" : "; " + next_move)) {}
  /// One that was told before, on another thread.
  explicit DeviceError(const std::string& message) : std::runtime_error(message) {}
};

}  // namespace kphi
