#include "drivers/iq/wire/packet.hpp"

#include <algorithm>
#include <boost/crc.hpp>
#include <cstring>

namespace kphi::iq {

bool operator==(const Packet& a, const Packet& b) noexcept {
  return a.type == b.type && a.length == b.length &&
         std::equal(a.payload.begin(), a.payload.begin() + a.length, b.payload.begin());
}

std::uint16_t checksum(std::span<const std::uint8_t> bytes) noexcept {
  boost::crc_optimal<16, 0x1021, 0xFFFF, 0, false, false> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return static_cast<std::uint16_t>(crc.checksum());
}

std::size_t encode(const Packet& packet, std::span<std::uint8_t, kMaxFrame> frame) noexcept {
  frame[0] = kStart;
  frame[1] = packet.length;
  frame[2] = packet.type;
  std::copy_n(packet.payload.begin(), packet.length, frame.begin() + 3);
  const std::uint16_t crc = checksum(frame.subspan(1, packet.length + 2u));
  frame[packet.length + 3u] = static_cast<std::uint8_t>(crc & 0xFF);
  frame[packet.length + 4u] = static_cast<std::uint8_t>(crc >> 8);
  return packet.length + kFrameOverhead;
}

std::size_t Parser::scan(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.empty()) return 0;
  const void* start = std::memchr(bytes.data(), kStart, bytes.size());
  if (start == nullptr) return discard(bytes.size());
  const auto noise = static_cast<std::size_t>(static_cast<const std::uint8_t*>(start) - bytes.data());
  if (noise > 0) return discard(noise);
  if (bytes.size() < 2) return 0;
  const std::size_t length = bytes[1];
  if (length > kMaxPayload) {
    ++counters_.refused_lengths;
    return discard(1);
  }
  if (bytes.size() < length + kFrameOverhead) return 0;
  if ((bytes[length + 3] | bytes[length + 4] << 8) != checksum(bytes.subspan(1, length + 2))) {
    ++counters_.crc_errors;
    return discard(1);
  }
  packet_.type = bytes[2];
  packet_.length = static_cast<std::uint8_t>(length);
  std::copy_n(bytes.begin() + 3, length, packet_.payload.begin());
  found_ = true;
  ++counters_.packets;
  return length + kFrameOverhead;
}

}  // namespace kphi::iq
