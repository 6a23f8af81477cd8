// Thread-safe mailbox between the callers of a motor and the thread of its link.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/wakeup.hpp"
#include "drivers/iq/session/session.hpp"

namespace kphi::iq {

class Link;

/// Time that a caller may stay silent while the motor spins, wall time.
inline constexpr Duration kLease = std::chrono::milliseconds(500);

/// The commands of callers to the link's thread.
struct Commands {
  std::optional<RadPerSec> speed;
  bool coast = false, emergency = false, rearm = false;
  std::optional<StopSettings> stop;
  std::optional<std::vector<Inquiry>> inquiry;
};

class ModuleHandle {
 public:
  explicit ModuleHandle(const std::string& device) : device_(device) {}
  ModuleHandle(const ModuleHandle&) = delete;
  ModuleHandle& operator=(const ModuleHandle&) = delete;

  // Callers; any thread unless it says otherwise.

  /// Renews the lease. + = counter-clockwise, zero coasts. Throws std::invalid_argument beyond ±3450 rad/s, DeviceError
  /// when the motor is not alive. Of commands that meet before the wire the last wins.
  void spin_at(RadPerSec signed_speed);
  /// The caller is alive. Never restarts a motor that has been coasted.
  void renew() noexcept;
  /// Overrules a spin_at that returned before.
  void coast() noexcept { order_coast(false); }
  /// As coast, three times at once.
  void emergency_stop() noexcept { order_coast(true); }
  /// Coasts, and waits for the module to report drive mode coast. False after `wall` or when the link is gone: the
  /// motor may still be turning.
  [[nodiscard]] bool coast_and_confirm(Duration wall) noexcept { return await_coast(order_coast(false), wall); }
  /// Ramps down, coasts, and waits until the motor is at rest or the settings' limit is over; keeps the lease
  /// meanwhile. Throws std::invalid_argument for settings that make no sense. Always ends coasting.
  [[nodiscard]] StopReport stop(const StopSettings& settings = {});

  /// Asks the module for these, between the polls; absent entries stay without a value. Blocks, at most 20 s. Throws
  /// std::invalid_argument for what is not a number or must not be set in passing (is_volatile_setting), DeviceError
  /// when it is not connected.
  [[nodiscard]] std::vector<Reply> inquire(std::vector<Inquiry> inquiries);

  /// Oldest readings first; one consumer thread. Holds 16384, about 160 s at 50 Hz; further ones are dropped and
  /// counted.
  std::size_t take(std::span<Reading> out) { return readings_.pop(out.data(), out.size()); }
  /// What happened, oldest first. 256 are kept.
  [[nodiscard]] std::vector<Event> take_events();
  /// False once the port is gone, the module stopped answering or restarted, or a coast stayed unconfirmed; true again
  /// only after rearm().
  [[nodiscard]] bool alive() const noexcept { return alive_; }
  /// The module answers: rearm() would succeed.
  [[nodiscard]] bool connected() const;
  /// The owner has seen the failure: the motor may spin again. Throws DeviceError unless connected.
  void rearm();
  /// Why it is not alive: the newest failure since the last rearm().
  [[nodiscard]] std::string failure() const;
  [[nodiscard]] const std::string& device() const noexcept { return device_; }
  [[nodiscard]] Identity identity() const;
  [[nodiscard]] Counters counters() const;
  [[nodiscard]] RoundTripHistogram round_trips() const;
  /// Bench time of the newest reading.
  [[nodiscard]] Instant newest_reading() const noexcept { return Instant(newest_reading_ns_); }

 protected:
  ~ModuleHandle() = default;
  /// Returns a ticket for await_coast.
  std::uint64_t order_coast(bool emergency) noexcept;
  [[nodiscard]] bool await_coast(std::uint64_t ticket, Duration wall) noexcept;

 private:
  friend class Link;
  using WallTime = std::chrono::steady_clock::time_point;
  struct Ticket {
    std::uint64_t asked = 0, taken = 0, done = 0;
    [[nodiscard]] bool open() const noexcept { return taken != done; }
  };

  /// True: connected; false: failed; nullopt: neither within `wall`.
  [[nodiscard]] std::optional<bool> await_connection(Duration wall);
  [[noreturn]] void refuse(const char* operation, const char* next_move) const;
  [[nodiscard]] bool lost() const noexcept { return ended_ || state_ == Session::State::failed; }

  // The link's thread.
  [[nodiscard]] Commands take_commands();
  void move_readings(Session& session);
  /// Shows callers the state of the session; its counters only when `all`. `line`: there is a port.
  void publish(Session& session, bool line, bool all);
  /// No thread serves this motor any more.
  void end(const std::string& why);
  [[nodiscard]] WallTime lease_end() const noexcept { return WallTime(std::chrono::nanoseconds(lease_end_ns_)); }
  bool note_state(const Session& session);
  bool close_tickets(const Session& session);

  const std::string device_;
  Wakeup commanded_;  ///< a caller has left commands

  std::mutex inquiring_;      ///< callers: one inquiry after the other
  mutable std::mutex mutex_;  ///< callers and the link's thread: everything down to the atomics
  std::condition_variable changed_;
  Commands commands_;
  Ticket coasts_, stops_, rearms_, inquiries_;
  StopReport stop_report_;
  std::vector<Reply> replies_;
  Session::State state_ = Session::State::idle;
  bool line_ = true, ended_ = false;
  std::string failure_;  ///< the last one that was not acknowledged
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
