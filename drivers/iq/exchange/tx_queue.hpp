// Frames waiting for the wire, in order, except that a coast goes before every frame that has not begun to leave.
#pragma once

#include <boost/container/static_vector.hpp>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/iq/wire/packet.hpp"

namespace kphi::iq {

/// Allocates nothing.
class TxQueue {
 public:
  enum class Kind : std::uint8_t { request, setting, motion, coast };
  /// Zeros before a padded coast. With the coast and one query after it they make 62 bytes: as many as the longest
  /// false header can still wait for, and one less than the module's receive buffer holds.
  static constexpr std::size_t kPadding = 48;

  /// False when there is no room: the line has not accepted bytes for long.
  [[nodiscard]] bool push(Kind kind, const Packet& packet) noexcept;
  /// Withdraws every motion command that has not begun to leave, and goes out before all other frames. False: three
  /// coasts wait already.
  bool push_coast(const Packet& packet, bool padded = false) noexcept;
  /// Drops all frames that have not begun to leave, except coasts. Returns the number of bytes dropped.
  std::size_t withdraw() noexcept;
  /// Drops everything.
  void clear() noexcept { *this = {}; }

  /// All waiting bytes, contiguous; valid until the next call of another member.
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept { return {bytes_.data(), bytes_.size()}; }
  /// The first `n` of them have left.
  void sent(std::size_t n) noexcept;

 private:
  static constexpr std::size_t kFrames = 24;
  struct Frame {
    Kind kind = Kind::request;
    std::size_t size = 0;  ///< in `bytes_`: what has not left yet
  };

  void insert(std::size_t at, Kind kind, const Packet& packet, std::size_t padding = 0) noexcept;
  void erase(std::size_t at) noexcept;
  /// Where this frame begins in `bytes_`.
  [[nodiscard]] std::ptrdiff_t offset(std::size_t at) const noexcept;
  [[nodiscard]] std::size_t first_whole() const noexcept { return begun_ ? 1 : 0; }

  boost::container::static_vector<Frame, kFrames> frames_;
  boost::container::static_vector<std::uint8_t, kFrames*(kPadding + kMaxFrame)> bytes_;  ///< of all frames
  bool begun_ = false;                                                                   ///< the first is leaving
};

}  // namespace kphi::iq
