#include "drivers/sim/supply/modbus_frame.hpp"

namespace kphi::sim {
namespace {

constexpr Duration kSilence = std::chrono::milliseconds(50);
constexpr std::size_t kHeader = 7;  // of TCP: transaction, protocol, length, unit
constexpr std::size_t kLongestPdu = 253;

void append16(std::vector<std::uint8_t>& out, unsigned value) {
  out.push_back(static_cast<std::uint8_t>(value >> 8));
  out.push_back(static_cast<std::uint8_t>(value));
}

unsigned word(const std::vector<std::uint8_t>& bytes, std::size_t at) { return bytes[at] * 256u + bytes[at + 1]; }

/// Bytes of a whole RTU request that begins like this; 0: not known yet.
std::size_t rtu_length(const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < 4) return 0;
  const unsigned function = bytes[1];
  if (function >= 1 && function <= 6) return 8;
  if (function != 15 && function != 16) return bytes.size();
  return bytes.size() < 7 ? 0 : 9u + bytes[6];
}

}  // namespace

std::uint16_t modbus_crc(std::span<const std::uint8_t> bytes) noexcept {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? crc >> 1 ^ 0xA001u : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

std::vector<std::uint8_t> modbus_frame(ModbusFraming framing, int unit, std::uint16_t transaction,
                                       std::span<const std::uint8_t> pdu) {
  std::vector<std::uint8_t> out;
  if (framing == ModbusFraming::tcp) {
    append16(out, transaction);
    append16(out, 0);
    append16(out, static_cast<unsigned>(pdu.size() + 1));
  }
  out.push_back(static_cast<std::uint8_t>(unit));
  out.insert(out.end(), pdu.begin(), pdu.end());
  if (framing == ModbusFraming::rtu) {
    const unsigned crc = modbus_crc(out);
    append16(out, (crc & 0xFFu) << 8 | crc >> 8);
  }
  return out;
}

void ModbusScanner::feed(std::span<const std::uint8_t> bytes, Instant now) {
  if (framing_ == ModbusFraming::rtu && !waiting_.empty() && now - last_ > kSilence) {
    waiting_.clear();
    ++damaged_;
  }
  last_ = now;
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
}

std::optional<ModbusRequest> ModbusScanner::next() { return framing_ == ModbusFraming::rtu ? next_rtu() : next_tcp(); }

std::optional<ModbusRequest> ModbusScanner::next_rtu() {
  const std::size_t length = rtu_length(waiting_);
  if (length == 0 || waiting_.size() < length) return std::nullopt;
  const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(length);
  const unsigned sent = waiting_[length - 1] * 256u + waiting_[length - 2];
  if (modbus_crc(std::span(waiting_).first(length - 2)) != sent) {
    waiting_.clear();
    ++damaged_;
    return std::nullopt;
  }
  ModbusRequest request{waiting_[0], 0, {waiting_.begin() + 1, end - 2}, {waiting_.begin(), end}};
  waiting_.erase(waiting_.begin(), end);
  return request;
}

std::optional<ModbusRequest> ModbusScanner::next_tcp() {
  if (broken_ || waiting_.size() < kHeader) return std::nullopt;
  const std::size_t length = word(waiting_, 4);
  if (word(waiting_, 2) != 0 || length < 2 || length > kLongestPdu + 1) {
    broken_ = true;
    ++damaged_;
    return std::nullopt;
  }
  if (waiting_.size() < kHeader - 1 + length) return std::nullopt;
  const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(kHeader - 1 + length);
  ModbusRequest request{waiting_[6],
                        static_cast<std::uint16_t>(word(waiting_, 0)),
                        {waiting_.begin() + static_cast<std::ptrdiff_t>(kHeader), end},
                        {waiting_.begin(), end}};
  waiting_.erase(waiting_.begin(), end);
  return request;
}

}  // namespace kphi::sim
