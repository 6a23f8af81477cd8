// A simulated box by itself, told and heard datagram by datagram.
#pragma once

#include <utility>
#include <vector>

#include "drivers/sim/netbox/device.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::sim::test {

inline const auto kRealTime = bytes("12 34 00 02 00 00 00 00"), kBias = bytes("12 34 00 42 00 00 00 00");

inline NetBoxDevice box_that(void (*habit)(NetBoxSettings&)) {
  NetBoxSettings settings;
  habit(settings);
  return NetBoxDevice(settings);
}

/// What it sends in so many ticks.
inline std::vector<Datagram> after(NetBoxDevice& box, int ticks, const Wrench& wrench = {}) {
  for (int i = 0; i < ticks; ++i) box.sample({Instant(i), wrench});
  std::vector<Datagram> all;
  for (Datagram next; box.next_datagram(next);) all.push_back(next);
  return all;
}

/// Reads a big-endian number at a record's offset, independently of the box's writer.
inline std::uint32_t word(const Datagram& datagram, std::size_t record, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value * 256 + datagram.bytes[36 * record + offset + i];
  return value;
}
inline std::uint32_t rdt(const Datagram& d, std::size_t record = 0) { return word(d, record, 0); }
inline std::uint32_t ft(const Datagram& d, std::size_t record = 0) { return word(d, record, 4); }
inline std::int32_t counts(const Datagram& d, std::size_t axis) {
  return static_cast<std::int32_t>(word(d, 0, 12 + 4 * axis));
}

}  // namespace kphi::sim::test
