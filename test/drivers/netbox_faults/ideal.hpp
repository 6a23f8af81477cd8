// What a perfect driver would have delivered and counted of one stream of the simulated box.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/sim/netbox/fault_injector.hpp"

namespace kphi::netbox::test {

/// A datagram of whole records that reached the session while it wanted any.
struct Arrival {
  std::uint32_t boot, stream, first_rdt;
  Instant at;
};

/// What the truth says the account must be. Late is what came when the driver had known of its absence for longer than
/// it promises to wait.
struct Ideal {
  struct Delivered {
    std::uint32_t rdt = 0, ft = 0;
    Instant arrival{0};
    friend bool operator==(const Delivered&, const Delivered&) = default;
  };
  std::uint64_t received = 0, lost = 0, duplicates = 0, late = 0, stalled = 0, restarts = 0, reboots = 0, irregular = 0;
  std::vector<Delivered> delivered;  ///< in this order
};

/// `truth` was kept by samples; `stride`: ft_sequence counts per record; `patience`: how long the driver waits for what
/// was overtaken.
[[nodiscard]] Ideal ideal_of(const sim::WireTruth& truth, std::span<const Arrival> arrivals, std::uint32_t stride,
                             Duration patience);

/// The first record number in a datagram, read independently of both sides.
[[nodiscard]] std::uint32_t first_rdt(std::span<const std::uint8_t> datagram);

}  // namespace kphi::netbox::test
