// One module's place at the link: where its owner, of any thread, and the link's thread meet.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "drivers/iq/session.hpp"

namespace kphi::iq {

/// What the owner wants of the link's thread.
struct Orders {
  std::optional<RadPerSec> speed;
  bool coast = false, emergency = false, rearm = false;
  std::optional<StopSettings> stop;
  std::optional<std::vector<Inquiry>> inquiry;
};

class Seat {
 public:
  using WallTime = std::chrono::steady_clock::time_point;

  /// `ring` wakes the link's thread.
  Seat(std::string name, std::function<void()> ring) : name_(std::move(name)), ring_(std::move(ring)) {}

  // The owner; any thread.
  void spin_at(RadPerSec signed_speed, Duration lease);
  void renew(Duration lease) noexcept;
  std::uint64_t coast(bool emergency) noexcept;
  [[nodiscard]] bool await_coast(std::uint64_t ticket, Duration wall) noexcept;
  [[nodiscard]] StopReport stop(const StopSettings& settings, Duration lease);
  [[nodiscard]] std::vector<Reply> inquire(std::vector<Inquiry> inquiries);
  void rearm();
  /// True: it is connected; false: it failed. Nothing: neither within `wall`.
  [[nodiscard]] std::optional<bool> await_connection(Duration wall);
  std::size_t take(std::span<Reading> out) { return readings_.pop(out.data(), out.size()); }
  [[nodiscard]] std::vector<Event> take_events();
  [[nodiscard]] bool alive() const noexcept { return alive_; }
  [[nodiscard]] bool connected() const;
  [[nodiscard]] std::string failure() const;
  [[nodiscard]] Identity identity() const;
  [[nodiscard]] Counters counters() const;
  [[nodiscard]] RoundTripHistogram round_trips() const;
  [[nodiscard]] Instant newest_reading() const noexcept { return Instant(newest_reading_ns_); }

  // The link's thread.
  [[nodiscard]] Orders take_orders();
  void move_readings(Session& session);
  /// Shows the owner what has become of the session; its counters only when `all`. `line`: there is a port.
  void publish(Session& session, bool line, bool all);
  /// No thread serves this seat any more.
  void end(const std::string& why);
  [[nodiscard]] WallTime lease_end() const noexcept { return WallTime(std::chrono::nanoseconds(lease_end_ns_)); }
  void count_lease_expiry() noexcept { ++lease_expiries_; }
  void count_reconnection() noexcept { ++reconnections_; }

 private:
  struct Ticket {
    std::uint64_t asked = 0, obeyed = 0, done = 0;
    [[nodiscard]] bool open() const noexcept { return obeyed != done; }
  };
  [[nodiscard]] bool lost() const noexcept { return ended_ || state_ == Session::State::failed; }
  [[noreturn]] void refuse(const char* operation, const char* next_move) const;
  bool note_state(const Session& session);
  bool close_tickets(const Session& session);

  const std::string name_;
  const std::function<void()> ring_;

  std::mutex inquiring_;      ///< owners: one inquiry after the other
  mutable std::mutex mutex_;  ///< owners and the link's thread: everything down to the atomics
  std::condition_variable changed_;
  Orders orders_;
  Ticket coasts_, stops_, rearms_, inquiries_;
  StopReport stop_report_;
  std::vector<Reply> replies_;
  Session::State state_ = Session::State::idle;
  bool line_ = true, ended_ = false;
  std::string failure_;  ///< of the last failure that was not acknowledged
  Identity identity_;
  Counters counters_;
  RoundTripHistogram round_trips_;
  std::vector<Event> events_;

  std::uint64_t dropped_readings_ = 0, lease_expiries_ = 0, reconnections_ = 0;  ///< the link's thread
  std::atomic<std::int64_t> lease_end_ns_{0};                                    ///< steady_clock
  std::atomic<std::int64_t> newest_reading_ns_{0};
  std::atomic<bool> alive_{true};
  boost::lockfree::spsc_queue<Reading> readings_{16384};
};

}  // namespace kphi::iq
