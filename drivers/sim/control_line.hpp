// The control socket of the simulated bench, by which a person or a campaign mounts propellers: a Unix-domain socket,
// one line in, one line out. `mount 5x3 90` -> `ok 5x3 90`; `hang z 4.9` -> `ok z 4.9` (a weight, N); `status` -> one
// line of JSON; else `error …`.
#pragma once

#include <string>
#include <string_view>

#include "drivers/sim/simulated_bench.hpp"

namespace kphi::sim {

/// The answer to one line, without the newline. Never throws for what the line says.
[[nodiscard]] std::string control_answer(SimulatedBench& bench, std::string_view line);

/// Where the socket is: a relative path lies in the system's temporary folder.
[[nodiscard]] std::string control_path(const std::string& configured);

/// Sends one line to a running simulator and returns its answer, both without newline. Waits 3 s at most.
/// Throws DeviceError without an answer.
[[nodiscard]] std::string tell(const std::string& path, const std::string& line);

}  // namespace kphi::sim
