// The load cell on its Net Box: reads the configuration, streams, starts again after a failure, and hands the records
// to one consumer. Writes none of the box's settings.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "base/published.hpp"
#include "base/wakeup.hpp"
#include "drivers/netbox/configuration/address.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/configuration/finding.hpp"
#include "drivers/netbox/receive/doorbell.hpp"
#include "drivers/netbox/receive/record_ring.hpp"
#include "drivers/netbox/receive/udp_socket.hpp"
#include "drivers/netbox/stream/batching.hpp"
#include "drivers/netbox/stream/event_queue.hpp"
#include "drivers/netbox/stream/health.hpp"
#include "drivers/netbox/stream/inquiry.hpp"
#include "drivers/netbox/stream/reconnect.hpp"
#include "drivers/netbox/stream/session.hpp"

namespace kphi::netbox {

/// One receive thread while it streams; how soon it hands records over: StreamPolicy::hand_over. Buffered, each
/// datagram goes at once. Single records at 7 kHz are prompt for a consumer in wait() (half the wake-ups, 0.6 of the
/// CPU time of one for each; 9 of 10 within 0.2 ms) and gathered for 2 ms for one that only takes now and then (0.15 of
/// it); at_once costs a wake-up for each (99 of 100 within 0.1 ms).
/// start, stop and the destructor belong to one thread, take and wait to one
/// (other or same); the rest may be called from any. Counters and queue outlive a stop and the next start.
class LoadCell {
 public:
  /// Reads the configuration over HTTP; sends nothing to the RDT port. `mode`: Command::buffered, real_time or
  /// multi_unit (as real_time, for several boxes in step).
  /// `clock` must outlive this. Throws DeviceError.
  LoadCell(const Address& address, const Clock& clock, Command mode = Command::buffered,
           const StreamPolicy& policy = {});
  /// Stops.
  ~LoadCell();
  LoadCell(const LoadCell&) = delete;
  LoadCell& operator=(const LoadCell&) = delete;

  /// As read at construction: the scale of the records until an event says configuration_changed.
  [[nodiscard]] const Configuration& configuration() const noexcept { return configuration_; }
  /// As read last: anew after each silence and each boot of the box.
  [[nodiscard]] Configuration latest_configuration() const { return inquiry_.latest(); }
  /// Returns once the first record has arrived. Throws DeviceError when none does, or when RDT is disabled.
  void start();
  /// Tells the box to stop, and waits a moment to see that it does.
  void stop() noexcept;

  /// Tells the box to take its present load as zero (0x42), and starts the stream again if the box stops it; returns
  /// at once. Whether it worked is to be measured: see bias.hpp. Any thread.
  void set_bias() noexcept;

  /// While started: the box forgets that a monitor condition of its own has been true (0x41); returns at once. That it
  /// has shows in the status of the records. Any thread.
  void reset_latch() noexcept;

  /// Oldest first; 0 = none waits.
  [[nodiscard]] std::size_t take(std::span<StampedRecord> out) noexcept;
  /// The same without a copy: `sink` is called with all that wait, in address (a std::span<const StampedRecord>; twice
  /// where they go over the end of the ring). Returns how many.
  template <class Sink>
  std::size_t consume(Sink&& sink) {
    return ring_.consume(std::forward<Sink>(sink));
  }
  /// True once records wait; false after `wall`.
  [[nodiscard]] bool wait(std::chrono::nanoseconds wall) noexcept;

  /// What has happened to the stream since the last call, oldest first; the thread of take and wait. After a silence
  /// the box is asked over HTTP, and the answer (taken_over, rdt_disabled, unusable, unreachable) comes here up to 2 s
  /// later, each once for as long as it stays the same; then what StreamPolicy allows is done about it. state() stays
  /// `silent` until records come again.
  [[nodiscard]] std::vector<Event> take_events();

  /// A consistent set, a few milliseconds old at most while records come.
  [[nodiscard]] Counters counters() const noexcept { return counters_.read(); }
  /// 20 ms older at most than counters().
  [[nodiscard]] Health health() const noexcept { return health_.read(); }
  /// Arrival of the newest accepted record; 0 before the first.
  [[nodiscard]] Instant newest_arrival() const noexcept { return Instant(newest_arrival_ns_.load()); }
  [[nodiscard]] State state() const noexcept { return state_.load(); }
  /// "8.0 MiB, tolerates 1440 ms": how long this process may stand still before the kernel drops datagrams.
  [[nodiscard]] std::string receive_buffer_note() const;
  /// The kernel has granted less buffer than asked for: how long may the process stand still, and what to do.
  [[nodiscard]] std::optional<Finding> receive_buffer_finding() const;
  /// As the kernel tells it.
  [[nodiscard]] std::size_t receive_buffer_bytes() const noexcept { return socket_.receive_buffer_bytes(); }

 private:
  void run() noexcept;
  void pump() noexcept;
  void wait_for_datagrams() noexcept;
  [[nodiscard]] Duration sleep_time() const noexcept;
  void drain() noexcept;
  void ingest(const UdpSocket::Datagram& datagram, Instant arrival) noexcept;
  void store_accepted() noexcept;
  void hand_over() noexcept;
  void send_requests() noexcept;
  void hand_over_events() noexcept;
  void linger() noexcept;
  void supervise(Instant now) noexcept;
  void note_answer(const Inquiry::Answer& answer) noexcept;
  void adopt_latest_stream();
  [[nodiscard]] State shown_state() const noexcept;
  void publish() noexcept;
  void publish_health() noexcept;
  [[noreturn]] void throw_unanswered() const;

  const Address address_;
  const Clock& clock_;
  const Configuration configuration_;
  const Command mode_;
  const StreamPolicy policy_;  // bench time
  UdpSocket socket_;
  std::thread thread_;
  std::atomic<bool> stopping_{false}, bias_asked_{false}, latch_reset_asked_{false};
  Wakeup order_wakeup_;
  Doorbell consumer_bell_;
  std::atomic<bool> records_wanted_{false};  // wait() was called since the receive thread looked last
  RecordRing ring_;
  EventQueue events_;
  Inquiry inquiry_;

  // The receive thread's own; others touch them only while it does not run.
  Session session_;
  Batching gathering_;
  bool awaited_ = false;     // by somebody in wait()
  std::size_t drained_ = 0;  // datagrams, last time
  std::vector<StampedRecord> accepted_;
  Instant newest_arrival_{0}, health_due_{0};
  HealthMeter meter_;
  Reconnect reconnect_;
  Configuration streamed_;  // what session_ is made for
  std::uint64_t queue_overflows_ = 0;

  // Published by the receive thread.
  std::atomic<State> state_{State::idle};
  std::atomic<std::int64_t> newest_arrival_ns_{0};
  Published<Counters> counters_;
  Published<Health> health_;
};

}  // namespace kphi::netbox
