// One question at a time, blocking: for what happens before there is a session — finding a baud rate, changing it,
// looking who is on a line. Motors coast before and after. Wall time. One thread.
#pragma once

#include <optional>

#include "drivers/iq/entries.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::iq {

class Conversation {
 public:
  /// Opens the port; throws DeviceError.
  Conversation(const std::string& device, unsigned baud) : port_(device, baud) {}

  [[nodiscard]] const std::string& device() const noexcept { return port_.device(); }
  [[nodiscard]] unsigned baud() const noexcept { return port_.baud(); }
  /// Waits until all has left; then both directions are emptied, and the module's parser too, which may wait for the
  /// end of what it took for a frame.
  void set_baud(unsigned baud);
  /// Throws serial::PortGone.
  void tell(const Packet& packet);
  /// The number answered, nothing within `wall` of the last byte sent. Replies to anything else are thrown away.
  [[nodiscard]] std::optional<double> ask(const Entry& entry, int module_id, Duration wall);
  /// All replies that come within `wall`, to `sink(const Packet&)`.
  template <class Sink>
  void listen(Duration wall, Sink&& sink) {
    const auto end = std::chrono::steady_clock::now() + wall;
    while (port_.wait(end - std::chrono::steady_clock::now())) read(sink);
  }
  /// The coast three times, by id and to all.
  void coast(int module_id);
  /// Whether the module reports drive mode coast after being told to.
  [[nodiscard]] bool coast_and_confirm(int module_id);

 private:
  void send(std::span<const std::uint8_t> bytes);
  template <class Sink>
  void read(Sink&& sink) {
    std::array<std::uint8_t, 512> buffer;
    const std::size_t n = port_.read(buffer);
    parser_.push(std::span<const std::uint8_t>(buffer).first(n), [&](const Packet& packet, std::uint64_t) {
      if (packet.standard() && packet.access() == Access::reply) sink(packet);
    });
  }

  serial::Port port_;
  Parser parser_;
};

}  // namespace kphi::iq
