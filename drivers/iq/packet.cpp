#include "drivers/iq/packet.hpp"

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

void Parser::drop(std::size_t n) noexcept {
  size_ -= n;
  std::memmove(held_.data(), held_.data() + n, size_);
}

Parser::Step Parser::scan() noexcept {
  const auto* begin = held_.data();
  const auto noise = static_cast<std::size_t>(std::find(begin, begin + size_, kStart) - begin);
  if (noise > 0) {
    counters_.discarded_bytes += noise;
    drop(noise);
  }
  if (size_ < 2) return Step::wait;
  const std::size_t length = held_[1];
  if (length > kMaxPayload) {
    ++counters_.refused_lengths;
    ++counters_.discarded_bytes;
    drop(1);
    return Step::again;
  }
  if (size_ < length + kFrameOverhead) return Step::wait;
  const std::uint16_t crc = checksum(std::span(held_).subspan(1, length + 2));
  if ((held_[length + 3] | held_[length + 4] << 8) != crc) {
    ++counters_.crc_errors;
    ++counters_.discarded_bytes;
    drop(1);
    return Step::again;
  }
  packet_.type = held_[2];
  packet_.length = static_cast<std::uint8_t>(length);
  std::copy_n(held_.begin() + 3, length, packet_.payload.begin());
  ++counters_.packets;
  drop(length + kFrameOverhead);
  return Step::found;
}

}  // namespace kphi::iq
