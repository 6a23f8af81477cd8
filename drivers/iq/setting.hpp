// Parameters of the firmware that are set for this connection only, and proven to have arrived.
#pragma once

#include <span>
#include <vector>

#include "drivers/finding.hpp"
#include "drivers/iq/dialogue.hpp"

namespace kphi::iq {

struct Setting {
  const Entry* entry = nullptr;
  double value = 0;
  bool required = true;  ///< false: firmware that does not know the entry is accepted
};

/// Sets each and reads it back; saves nothing. A finding for each that is not as set: a fault.
[[nodiscard]] std::vector<Finding> set_and_read_back(Dialogue& module, std::span<const Setting> settings);

/// What every connection sets: the communication timeout, coast at its end, and no song.
[[nodiscard]] std::vector<Setting> connection_settings(double module_timeout_s);

}  // namespace kphi::iq
