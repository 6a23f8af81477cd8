// What happened to the stream, by name, with the numbers that showed it. Values only; one thread per log.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "drivers/netbox/configuration/changes.hpp"

namespace kphi::netbox {

enum class EventKind : std::uint8_t {
  restarted,     ///< rdt_sequence began anew, ft_sequence went on: a start was repeated, or came from another client
  rebooted,      ///< ft_sequence began anew: bias and scale are to be doubted
  stalled,       ///< new records repeat one measurement
  stall_ended,   ///< `records` were repeated
  silent,        ///< no record for longer than the silence timeout
  resumed,       ///< records again after a silence
  box_trouble,   ///< status bit 20 (RDT) or 22 (network) rose: the box itself saw its communication fail
  taken_over,    ///< silence, but the box answers and RDT is enabled: another client has the stream, or the box booted
  rdt_disabled,  ///< silence, and the box says that RDT is disabled
  unreachable,   ///< silence, and the box does not answer over HTTP either
  unusable,      ///< silence or a boot, and the box's configuration cannot be measured with
  reconnected,   ///< the stream was started again after a silence
  configuration_changed,  ///< `changes`: what arrives from now on, and since the silence or boot before, is another
                          ///< segment with another meaning
  given_up,               ///< no reconnection in the time set for it
};

struct Event {
  EventKind kind = EventKind::silent;
  Instant at{0};                                    ///< bench time
  std::uint32_t rdt = 0, ft = 0;                    ///< of the record that showed it
  std::uint32_t previous_rdt = 0, previous_ft = 0;  ///< of the accepted record before
  std::uint64_t records = 0;                        ///< missing before it; of a stall: repeated
  std::uint32_t status = 0;                         ///< of box_trouble
  Changes changes = 0;                              ///< of configuration_changed
  friend bool operator==(const Event&, const Event&) = default;
};

/// One line: "12.345 s: the stream began anew (rdt 1 after 2000, ft 5100 after 5099), 0 records missing".
[[nodiscard]] std::string to_string(const Event& event);

/// Keeps the oldest kCapacity events; those beyond are counted.
class EventLog {
 public:
  static constexpr std::size_t kCapacity = 64;
  void note(const Event& event) noexcept {
    if (count_ < kCapacity) {
      events_[count_++] = event;
    } else {
      ++dropped_;
    }
  }
  /// Oldest first; they are gone from here then.
  [[nodiscard]] std::vector<Event> take() {
    std::vector<Event> taken(events_.begin(), events_.begin() + static_cast<std::ptrdiff_t>(count_));
    count_ = 0;
    return taken;
  }
  /// As take(), without allocation.
  template <class Sink>
  void drain(Sink&& sink) noexcept {
    for (std::size_t i = 0; i < count_; ++i) sink(events_[i]);
    count_ = 0;
  }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  std::array<Event, kCapacity> events_{};
  std::size_t count_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace kphi::netbox
