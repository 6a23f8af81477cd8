// Where a silent module is: at another baud rate, or under another id. Looks only: never writes a rate or an id. Coasts
// whatever listens, first. Blocking; wall time.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace kphi::iq {

/// In the order in which they are tried: the factory's, the usual, then the rest.
[[nodiscard]] const std::vector<unsigned>& bauds_to_try();

/// The rate at which the module with this id answers; `first` is tried before all others; nullopt: at no rate. About 3
/// s when nothing answers. Throws DeviceError when the port cannot be opened or is lost.
[[nodiscard]] std::optional<unsigned> find_baud(const std::string& device, int module_id, unsigned first = 115200);

/// The ids that answer at this rate, ascending. About 1.3 s. Throws as find_baud does.
[[nodiscard]] std::vector<int> find_ids(const std::string& device, unsigned baud);

}  // namespace kphi::iq
