// RDT, the wire: requests of 8 bytes, records of 36, big-endian (manual 9620-05-NET FT, section 10). Bytes only: no
// socket, no time, no judgement.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/netbox/codes.hpp"

namespace kphi::netbox {

inline constexpr std::size_t kRecordBytes = 36, kMaxRecords = 40;

/// One sample. Force and torque in counts of the configured unit (Configuration has the scale).
struct Record {
  std::uint32_t rdt_sequence = 0;        ///< place in this stream, 1 at each start, wraps
  std::uint32_t ft_sequence = 0;         ///< internal sample number since power-up, wraps
  std::uint32_t status = 0;              ///< see status.hpp
  std::array<std::int32_t, 6> counts{};  ///< Fx Fy Fz Tx Ty Tz
  friend bool operator==(const Record&, const Record&) = default;
};

/// `sample_count` 0 = until stopped.
[[nodiscard]] std::array<std::uint8_t, 8> encode_request(Command command, std::uint32_t sample_count = 0) noexcept;

/// Number of records written to `out`: 1..40; 0 = refused, not a whole number of records or more than 40.
[[nodiscard]] std::size_t decode(std::span<const std::uint8_t> datagram, std::span<Record, kMaxRecords> out) noexcept;

}  // namespace kphi::netbox
