// A serial line held by hand, blocking: for what happens without a session — finding a baud rate, changing it, looking
// who is on a line, an audit. Wall time. One thread.
#pragma once

#include <optional>

#include "drivers/iq/entries.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::iq {

/// Of this entry by this module, whatever its data.
[[nodiscard]] bool is_reply_of(const Packet& packet, const Entry& asked, int module_id) noexcept;

class Conversation {
 public:
  /// Opens the port; throws DeviceError.
  Conversation(const std::string& device, unsigned baud) : port_(device, baud) {}

  [[nodiscard]] const std::string& device() const noexcept { return port_.device(); }
  [[nodiscard]] unsigned baud() const noexcept { return port_.baud(); }
  /// Waits until all has left; then both directions are emptied, and the module's parser too, which may wait for the
  /// end of what it took for a frame.
  void set_baud(unsigned baud);
  /// False: the line took it not, or not in whole. Throws serial::PortGone.
  bool tell(const Packet& packet);
  /// The number answered, nothing within `wall` of the last byte sent. Replies to anything else are thrown away.
  [[nodiscard]] std::optional<double> ask(const Entry& entry, int module_id, Duration wall);
  /// All packets that come within `wall`, to `sink(const Packet&)`, until it returns true. Whether it did.
  template <class Sink>
  bool listen(Duration wall, Sink&& sink) {
    const auto end = std::chrono::steady_clock::now() + wall;
    bool enough = false;
    while (!enough && port_.wait(end - std::chrono::steady_clock::now())) {
      std::array<std::uint8_t, 512> buffer;
      const std::size_t n = port_.read(buffer);
      parser_.push(std::span<const std::uint8_t>(buffer).first(n),
                   [&](const Packet& packet, std::uint64_t) { enough = sink(packet) || enough; });
    }
    return enough;
  }
  /// Forgets a frame that never became whole. Whether there was one.
  bool resynchronise() noexcept;
  [[nodiscard]] const Parser::Counters& heard() const noexcept { return parser_.counters(); }
  /// The coast three times, by id and to all.
  void coast(int module_id);
  /// Whether the module reports drive mode coast after being told to.
  [[nodiscard]] bool coast_and_confirm(int module_id);

 private:
  bool send(std::span<const std::uint8_t> bytes);

  serial::Port port_;
  Parser parser_;
};

}  // namespace kphi::iq
