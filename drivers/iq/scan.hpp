// Who is on a line: every module id is asked in turn. Coasts all first. Blocks for about 1.4 s; wall time.
#pragma once

#include <string>
#include <vector>

namespace kphi::iq {

struct Found {
  int module_id = 0;
  bool legacy = false;  ///< its system_control answers on id 0 only
};

/// In the order of their ids. Throws DeviceError when the port cannot be opened or goes away.
[[nodiscard]] std::vector<Found> scan(const std::string& device, unsigned baud);

}  // namespace kphi::iq
