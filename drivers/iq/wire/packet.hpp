// The IQUART frame, bytes only: 55 LEN TYPE payload[LEN] CRC_L CRC_H, no escaping. LEN counts the payload alone.
// CRC-16/CCITT-FALSE over LEN, TYPE and payload, low byte first. A standard payload is SUB ACCESS data.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "drivers/iq/wire/codes.hpp"

namespace kphi::iq {

inline constexpr std::uint8_t kStart = 0x55;
inline constexpr std::size_t kMaxPayload = 59;
inline constexpr std::size_t kFrameOverhead = 5;
inline constexpr std::size_t kMaxFrame = kMaxPayload + kFrameOverhead;

struct Packet {
  std::uint8_t type = 0;
  std::uint8_t length = 0;  ///< bytes of payload in use, 0..59
  std::array<std::uint8_t, kMaxPayload> payload{};

  /// SUB and ACCESS are there.
  [[nodiscard]] bool standard() const noexcept { return length >= 2; }
  [[nodiscard]] std::uint8_t sub() const noexcept { return payload[0]; }
  [[nodiscard]] Access access() const noexcept { return static_cast<Access>(payload[1] & 3); }
  [[nodiscard]] int module_id() const noexcept { return payload[1] >> 2; }
  /// What follows SUB and ACCESS.
  [[nodiscard]] std::span<const std::uint8_t> data() const noexcept {
    return standard() ? std::span(payload).subspan(2, length - 2u) : std::span<const std::uint8_t>{};
  }
};

[[nodiscard]] bool operator==(const Packet& a, const Packet& b) noexcept;

/// CRC-16/CCITT-FALSE; of "123456789": 0x29B1.
[[nodiscard]] std::uint16_t checksum(std::span<const std::uint8_t> bytes) noexcept;

/// Writes the frame, returns its size. `packet.length` must be at most 59.
std::size_t encode(const Packet& packet, std::span<std::uint8_t, kMaxFrame> frame) noexcept;

/// Finds frames in a stream of bytes, in whatever chunks it comes. Nothing intact is lost: after a bad CRC or a LEN
/// over 59 the search continues at the byte after the false 0x55.
class Parser {
 public:
  struct Counters {
    std::uint64_t bytes_in = 0;         ///< all that was pushed
    std::uint64_t packets = 0;          ///< whole, with a good CRC
    std::uint64_t crc_errors = 0;       ///< candidates with a bad CRC
    std::uint64_t refused_lengths = 0;  ///< candidates with LEN over 59
    std::uint64_t discarded_bytes = 0;  ///< bytes that belong to no packet
  };

  /// Calls `sink(const Packet&, std::uint64_t end)` for each packet; `end` = bytes of the stream up to its last one.
  template <class Sink>
  void push(std::span<const std::uint8_t> bytes, Sink&& sink) {
    counters_.bytes_in += bytes.size();
    held_.insert(held_.end(), bytes.begin(), bytes.end());
    read(sink);
  }

  /// Gives up the frame being waited for: its 0x55 was noise. Packets hidden behind it come out. The session calls
  /// this when a frame has been incomplete for too long.
  template <class Sink>
  void abandon(Sink&& sink) {
    if (held_.empty()) return;
    discard(1);
    held_.erase(held_.begin());
    read(sink);
  }

  /// Forgets the frame being waited for.
  void reset() noexcept {
    discard(held_.size());
    held_.clear();
  }

  /// A frame has begun and is not complete.
  [[nodiscard]] bool partial() const noexcept { return !held_.empty(); }
  /// Position of its first byte in all bytes pushed so far: tells one partial frame from the next.
  [[nodiscard]] std::uint64_t partial_offset() const noexcept { return counters_.bytes_in - held_.size(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  /// Reads all that is complete.
  template <class Sink>
  void read(Sink& sink) {
    const std::span<const std::uint8_t> held(held_);
    std::size_t done = 0;
    while (const std::size_t n = scan(held.subspan(done))) {
      done += n;
      if (std::exchange(found_, false)) sink(std::as_const(packet_), partial_offset() + done);
    }
    held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(done));
  }
  /// Classifies the beginning: noise, a false header, or a packet. Returns its size; 0: it is incomplete.
  std::size_t scan(std::span<const std::uint8_t> bytes) noexcept;
  std::size_t discard(std::size_t n) noexcept {
    counters_.discarded_bytes += n;
    return n;
  }

  std::vector<std::uint8_t> held_;  ///< from the first byte that is not understood yet
  bool found_ = false;
  Packet packet_;
  Counters counters_;
};

}  // namespace kphi::iq
