// What differs between two readings of one box: all that gives its counts another meaning.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/netbox/configuration/configuration.hpp"

namespace kphi::netbox {

/// Bits of Changes.
enum class Change : std::uint32_t {
  product = 1u << 0,
  firmware = 1u << 1,
  calibration = 1u << 2,
  slot = 1u << 3,
  units = 1u << 4,
  counts_per_unit = 1u << 5,
  ranges = 1u << 6,
  rate = 1u << 7,
  records_per_datagram = 1u << 8,
  filter = 1u << 9,
  tool_transform = 1u << 10,
  gage_bias = 1u << 11,
};
using Changes = std::uint32_t;

[[nodiscard]] constexpr bool has(Changes changes, Change change) noexcept {
  return (changes & static_cast<Changes>(change)) != 0;
}
/// Another stream: its records are to be counted and timed otherwise.
[[nodiscard]] constexpr bool changes_stream(Changes changes) noexcept {
  return has(changes, Change::product) || has(changes, Change::rate) || has(changes, Change::records_per_datagram);
}

[[nodiscard]] Changes compare(const Configuration& before, const Configuration& after);
/// "calibration, filter"; empty for none.
[[nodiscard]] std::string to_words(Changes changes);

/// The box's peaks are narrower than they were: it has forgotten them, so it has started anew (or a person has reset
/// them on its Snapshot page).
[[nodiscard]] bool forgot_peaks(const Configuration& before, const Configuration& after) noexcept;

}  // namespace kphi::netbox
