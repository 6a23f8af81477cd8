// READCALINFO over TCP 49151: the box's scale from a second source (manual p.76-77). Nothing else is sent: READFT would
// switch the monitor conditions off.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "base/finding.hpp"
#include "base/tcp.hpp"
#include "drivers/netbox/configuration/configuration.hpp"

namespace kphi::netbox {

inline constexpr std::size_t kCalinfoBytes = 24;

struct Calinfo {
  std::uint8_t force_unit = 0, torque_unit = 0;  ///< codes of wire/unit.hpp
  std::uint32_t counts_per_force = 0, counts_per_torque = 0;
  friend bool operator==(const Calinfo&, const Calinfo&) = default;
};

[[nodiscard]] std::array<std::uint8_t, 20> encode_read_calinfo() noexcept;
/// nullopt: wrong header or size.
[[nodiscard]] std::optional<Calinfo> decode_calinfo(std::span<const std::uint8_t> bytes) noexcept;

/// Blocks for at most `wall_timeout`. Throws DeviceError without a connection or a complete, valid answer.
[[nodiscard]] Calinfo read_calinfo(const Host& host, std::uint16_t port, std::chrono::nanoseconds wall_timeout);

/// A fault when the two disagree about counts per newton or newton-metre by more than 1 in 10^6 or a unit is unknown.
[[nodiscard]] std::optional<Finding> compare(const Calinfo& calinfo, const Configuration& configuration);
/// read_calinfo and compare; a note if the box does not answer there.
[[nodiscard]] std::optional<Finding> cross_check(const Host& host, std::uint16_t port,
                                                 const Configuration& configuration,
                                                 std::chrono::nanoseconds wall_timeout);

}  // namespace kphi::netbox
