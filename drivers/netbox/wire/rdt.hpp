// RDT on the wire: requests of 8 bytes, records of 36, big-endian (manual 9620-05-NET FT, section 10).
#pragma once

#include <array>
#include <bit>
#include <boost/endian/conversion.hpp>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

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

/// One sample. Force and torque in counts of the configured unit (Configuration has the scale).
struct Record {
  std::uint32_t rdt_sequence = 0;        ///< place in this stream, 1 at each start, wraps
  std::uint32_t ft_sequence = 0;         ///< internal sample number since power-up, wraps
  std::uint32_t status = 0;              ///< see status.hpp
  std::array<std::int32_t, 6> counts{};  ///< Fx Fy Fz Tx Ty Tz
  friend bool operator==(const Record&, const Record&) = default;
};

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
inline void decode(const std::uint8_t* bytes, Record& out) noexcept {
  static_assert(sizeof(Record) == kRecordBytes && std::is_trivially_copyable_v<Record>);
  auto* to = reinterpret_cast<std::uint8_t*>(&out);
  // Two words at a time; swapping the bytes of the pair swaps the words, too.
  constexpr int turn = std::endian::native == std::endian::little ? 32 : 0;
  for (std::size_t at = 0; at < 32; at += 8) {
    std::uint64_t pair;
    std::memcpy(&pair, bytes + at, sizeof pair);
    pair = std::rotr(boost::endian::big_to_native(pair), turn);
    std::memcpy(to + at, &pair, sizeof pair);
  }
  const std::uint32_t last = boost::endian::load_big_u32(bytes + 32);
  std::memcpy(to + 32, &last, sizeof last);
}

/// Number of records written to `out`: records_in().
[[nodiscard]] inline std::size_t decode(std::span<const std::uint8_t> datagram,
                                        std::span<Record, kMaxRecords> out) noexcept {
  const std::size_t count = records_in(datagram.size());
  for (std::size_t i = 0; i < count; ++i) decode(datagram.data() + i * kRecordBytes, out[i]);
  return count;
}

}  // namespace kphi::netbox
