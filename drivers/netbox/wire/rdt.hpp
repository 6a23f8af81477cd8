// RDT on the wire: requests of 8 bytes, records of 36, big-endian (manual 9620-05-NET FT, section 10).
#pragma once

#include <array>
#include <boost/endian/conversion.hpp>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/device_data.hpp"

namespace kphi::netbox {

/// Commands (Table 10.1). None is acknowledged; the newest wins, whoever sent it.
enum class Command : std::uint16_t {
  stop = 0,
  real_time = 2,         ///< one record per datagram
  axia_multi_block = 2,  ///< Ethernet Axia: "RDT Buffer Size" records per datagram
  buffered = 3,          ///< "RDT Buffer Size" records per datagram
  set_bias = 0x42,
};

inline constexpr std::size_t kRecordBytes = 36, kMaxRecords = 40;

/// `sample_count` 0 = until stopped.
[[nodiscard]] inline std::array<std::uint8_t, 8> encode_request(Command command,
                                                                std::uint32_t sample_count = 0) noexcept {
  std::array<std::uint8_t, 8> request{};
  boost::endian::store_big_u16(&request[0], 0x1234);
  boost::endian::store_big_u16(&request[2], static_cast<std::uint16_t>(command));
  boost::endian::store_big_u32(&request[4], sample_count);
  return request;
}

/// 1..40; 0: refused, not a multiple of 36 bytes or more than 40 records.
[[nodiscard]] constexpr std::size_t records_in(std::size_t datagram_bytes) noexcept {
  const std::size_t count = datagram_bytes / kRecordBytes;
  return datagram_bytes % kRecordBytes == 0 && count <= kMaxRecords ? count : 0;
}

/// One record from its kRecordBytes.
inline void decode(const std::uint8_t* bytes, LoadCellRecord& out, Instant arrival = {}) noexcept {
  out.arrival_ns = arrival.count();
  out.rdt_sequence = boost::endian::load_big_u32(bytes);
  out.ft_sequence = boost::endian::load_big_u32(bytes + 4);
  out.status = boost::endian::load_big_u32(bytes + 8);
  for (std::size_t axis = 0; axis < 6; ++axis) out.counts[axis] = boost::endian::load_big_s32(bytes + 12 + 4 * axis);
}

/// Number of records written to `out`: records_in(), which it has room for.
inline std::size_t decode(std::span<const std::uint8_t> datagram, std::span<LoadCellRecord> out,
                          Instant arrival = {}) noexcept {
  const std::size_t count = records_in(datagram.size());
  for (std::size_t i = 0; i < count; ++i) decode(datagram.data() + i * kRecordBytes, out[i], arrival);
  return count;
}

}  // namespace kphi::netbox
