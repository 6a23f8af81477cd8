// Sockets of the simulated box that others can reach.
#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>

#include "drivers/sim/descriptor.hpp"

namespace kphi::sim {

struct Listening {
  Descriptor socket;
  std::uint16_t port = 0;
};

/// Non-blocking; `type`: SOCK_DGRAM (with a large send buffer) or SOCK_STREAM; port 0: any free one. `host`: IPv4 name
/// or address. Throws DeviceError.
[[nodiscard]] Listening listen_at(const std::string& host, int type, std::uint16_t port);

}  // namespace kphi::sim
