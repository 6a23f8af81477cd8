#include "drivers/sim/iq/frame.hpp"

#include <algorithm>
#include <boost/crc.hpp>

#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

constexpr std::uint8_t kStart = 0x55;
constexpr std::size_t kPayloadMax = 59;
constexpr std::size_t kOverhead = 5;  // start, LEN, TYPE, CRC

}  // namespace

std::uint16_t iq_crc(std::span<const std::uint8_t> bytes) noexcept {
  boost::crc_optimal<16, 0x1021, 0xffff, 0, false, false> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return static_cast<std::uint16_t>(crc.checksum());
}

void append_iq_frame(std::vector<std::uint8_t>& out, std::uint8_t type, std::uint8_t sub, std::uint8_t access,
                     std::span<const std::uint8_t> data) {
  const std::size_t first = out.size();
  out.insert(out.end(), {kStart, static_cast<std::uint8_t>(data.size() + 2), type, sub, access});
  out.insert(out.end(), data.begin(), data.end());
  const std::uint16_t crc = iq_crc(std::span(out).subspan(first + 1));
  out.push_back(static_cast<std::uint8_t>(crc & 0xff));
  out.push_back(static_cast<std::uint8_t>(crc >> 8));
}

std::size_t IqScanner::feed(std::span<const std::uint8_t> bytes) {
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(position_));
  position_ = 0;
  const std::size_t room = capacity_ == 0 ? bytes.size() : capacity_ - bytes_.size();
  const auto taken = bytes.first(std::min(room, bytes.size()));
  bytes_.insert(bytes_.end(), taken.begin(), taken.end());
  return taken.size();
}

void IqScanner::clear() noexcept {
  bytes_.clear();
  position_ = 0;
}

std::optional<IqFrame> IqScanner::next() noexcept {
  for (; position_ < bytes_.size(); ++position_) {
    const auto rest = std::span<const std::uint8_t>(bytes_).subspan(position_);
    if (rest[0] != kStart) continue;
    if (rest.size() < 2) return std::nullopt;
    const std::size_t length = rest[1];
    if (length <= kPayloadMax && rest.size() < length + kOverhead) return std::nullopt;
    if (length > kPayloadMax || iq_crc(rest.subspan(1, length + 2)) != little(rest.subspan(length + 3, 2))) continue;
    position_ += length + kOverhead;
    return IqFrame{rest[2], rest.subspan(3, length)};
  }
  return std::nullopt;
}

}  // namespace kphi::sim
