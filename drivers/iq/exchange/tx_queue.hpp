// Frames waiting for the wire, in order, except that a coast goes before every frame that has not begun to leave.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/iq/wire/packet.hpp"

namespace kphi::iq {

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
  void clear() noexcept;

  /// All waiting bytes, contiguous; valid until the next call of another member.
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept { return {wire_.data(), wire_size_}; }
  /// The first `n` of them have left.
  void sent(std::size_t n) noexcept;

 private:
  static constexpr std::size_t kFrames = 24;
  static constexpr std::size_t kWaitingCoasts = 3;
  static constexpr std::size_t kRoom = kPadding + kMaxFrame;
  struct Frame {
    Kind kind = Kind::request;
    std::size_t size = 0;
    std::array<std::uint8_t, kRoom> bytes{};
  };

  void insert(std::size_t at, Kind kind, const Packet& packet, std::size_t padding = 0) noexcept;
  void erase(std::size_t at) noexcept;
  void lay_out() noexcept;
  [[nodiscard]] std::size_t first_whole() const noexcept { return begun_ > 0 ? 1 : 0; }

  std::array<Frame, kFrames> frames_;
  std::size_t count_ = 0;
  std::size_t begun_ = 0;  ///< bytes of the first frame that have left
  std::array<std::uint8_t, kFrames * kRoom> wire_{};
  std::size_t wire_size_ = 0;
};

}  // namespace kphi::iq
