// The load cell on its Net Box over the network: reads the configuration, streams, reconnects after a failure, and
// queues the records for one consumer. Writes none of the box's settings.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include "base/clock.hpp"
#include "base/descriptor.hpp"
#include "base/published.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/receive/udp_socket.hpp"
#include "drivers/netbox/stream/connection.hpp"

namespace kphi::netbox {

/// A Connection with its socket and its receive thread while it streams. Records reach the queue at once when buffered,
/// single ones within 2 ms (0.15 of the wake-ups of a thread that wakes up for each). start, stop and the destructor
/// belong to one thread; take, wait and take_events to one, the same or another; the rest is thread-safe. Counters and
/// queue survive a stop and the next start.
class LoadCell {
 public:
  /// Reads the configuration over HTTP; sends nothing to the RDT port. `clock` must outlive this. Throws DeviceError.
  LoadCell(const Address& address, const Clock& clock);
  /// Stops, and waits for a question under way, at most kAnswerTimeout.
  ~LoadCell();
  LoadCell(const LoadCell&) = delete;
  LoadCell& operator=(const LoadCell&) = delete;

  /// As read at construction: the scale of the records until an event says configuration_changed.
  [[nodiscard]] const Configuration& configuration() const noexcept { return configuration_; }
  /// Returns once the first record has arrived. Throws DeviceError if none arrives or if RDT is disabled.
  void start();
  /// Tells the box to stop, and waits up to 100 ms to see that it does.
  void stop() noexcept;
  /// Tells the box to take its present load as zero (0x42), and starts the stream again if the box stops it; returns
  /// at once. Not acknowledged: measure the result. Thread-safe.
  void set_bias() noexcept;

  /// Oldest first; returns how many.
  [[nodiscard]] std::size_t take(std::span<LoadCellRecord> out) noexcept { return connection_.take(out); }
  /// True once records wait; false after `wall`.
  [[nodiscard]] bool wait(std::chrono::nanoseconds wall) noexcept;
  /// Events since the last call, oldest first. After a silence the box is asked over HTTP; its answer (taken_over,
  /// rdt_disabled, unusable, unreachable) follows within 2 s, and again whenever it changes.
  [[nodiscard]] std::vector<Event> take_events() { return connection_.take_events(); }

  /// A consistent set, a few milliseconds old at most while records arrive.
  [[nodiscard]] Counters counters() const noexcept { return counters_.read(); }
  /// At most 20 ms older than counters().
  [[nodiscard]] StreamHealth health() const noexcept { return health_.read(); }
  [[nodiscard]] State state() const noexcept { return state_.load(); }
  [[nodiscard]] ReceiveBuffer receive_buffer() const;

 private:
  enum class Inquiry : std::uint8_t { none, asked, answered, ending };

  void run() noexcept;
  void pump() noexcept;
  void wait_for_datagrams() noexcept;
  void drain() noexcept;
  void hand_over() noexcept;
  void send_requests() noexcept;
  void exchange_answers() noexcept;
  void answer_questions() noexcept;
  void linger() noexcept;
  void publish(bool with_health) noexcept;

  const Address address_;
  const Clock& clock_;
  const Configuration configuration_;
  UdpSocket socket_;
  Connection connection_;  // the receive thread's while it runs, except what belongs to the consumer
  Wakeup order_wakeup_;
  std::thread thread_;
  std::atomic<bool> stopping_{false}, bias_requested_{false};
  std::atomic<std::uint32_t> consumer_waits_{0};  // a futex: poll(2) costs both threads more
  std::size_t drained_ = 0;                       // datagrams, last time
  Instant emptied_{0};                            // none that waits in the socket arrived before
  Instant health_due_{0};

  // Published by the receive thread.
  std::atomic<State> state_{State::idle};
  Published<Counters> counters_;
  Published<StreamHealth> health_;

  std::atomic<Inquiry> inquiry_{Inquiry::none};
  Answer answer_;  // the inquirer's while `asked`, the receive thread's while `answered`
  std::thread inquirer_;
};

}  // namespace kphi::netbox
