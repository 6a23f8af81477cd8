// The motor module on a serial port: one session, pumped by a thread of its own.
//
// Safety. The motor coasts: when asked, from any thread; when neither spin_at nor renew was called for 0.5 s of
// wall time, although polling continues; when the module or the port fails; when the module has restarted by itself;
// when the thread ends for whatever reason; and when the object is destroyed. If this process is killed, the module's
// own communication timeout coasts it.
//
// After a failure the link looks for the port and the module by itself and coasts the module that it finds. It never
// spins it again: for that its owner makes a new Motor.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/descriptor.hpp"
#include "drivers/iq/session/session.hpp"

namespace kphi::iq {

class Link;

/// Time that a caller may stay silent while the motor spins, wall time.
inline constexpr Duration kLease = std::chrono::milliseconds(500);

/// The commands of callers to the link's thread.
struct Commands {
  std::optional<RadPerSec> speed;
  std::uint64_t after_coasts = 0;  ///< how many coasts had been asked for before the speed
  std::optional<StopSettings> stop;
  std::optional<std::vector<Inquiry>> inquiry;
};

/// A motor on its link. Callers and the link's thread meet in this object, which is thread-safe.
class Motor {
 public:
  /// Opens the port exclusively and connects (coasting first); blocks for at most 10 s, usually some 50 ms. Deadlines
  /// of the protocol are wall time: `settings.reply_timeout` 0 becomes clock.stretched(100 ms), wire_byte_time 0
  /// becomes 10/baud. module_timeout_s goes to the module as it is, in the module's own seconds. Throws DeviceError:
  /// port missing, forbidden or in use, no module answers, the module refused its communication timeout. Prefer a
  /// `device` name that stays (/dev/serial/by-id/…): it is opened again after the port was lost. `clock` must outlive
  /// the motor. `capture`: file for all bytes of the line (capture.hpp); empty: no capture. `give_up` is asked while it
  /// connects; true: DeviceError. One that only inspects
  /// (Settings) is never alive.
  Motor(const std::string& device, unsigned baud, const Settings& settings, const Clock& clock,
        const std::string& capture = {}, const std::function<bool()>& give_up = {});
  /// Closes.
  ~Motor();
  /// Coasts three times, waits at most 0.6 s for drive mode coast, closes the port. Afterwards other threads may still
  /// call any member. The thread that made it; again without effect.
  void close() noexcept;

  // Callers; any thread unless it says otherwise.

  /// Renews the lease. + = counter-clockwise, zero coasts. Throws std::invalid_argument beyond ±3450 rad/s, DeviceError
  /// when the motor is not alive. Of commands that meet before the wire the last wins.
  void spin_at(RadPerSec signed_speed);
  /// The caller is alive. Never restarts a motor that has been coasted.
  void renew() noexcept;
  /// Coasts, three times at once. Overrules a spin_at that returned before.
  /// Takes no lock: an atomic word and an eventfd, whatever another thread is doing.
  void emergency_stop() noexcept { order_coast(); }
  /// Ramps down, coasts, and waits until the motor is at rest or the settings' limit is over; keeps the lease
  /// meanwhile. Throws std::invalid_argument for settings that make no sense. Always ends coasting.
  [[nodiscard]] StopReport stop(const StopSettings& settings = {});
  /// As stop(), without waiting: its ticket. The caller renews the lease meanwhile.
  [[nodiscard]] std::uint64_t begin_stop(const StopSettings& settings);
  /// nullopt while that stop is under way.
  [[nodiscard]] std::optional<StopReport> stop_report(std::uint64_t ticket) const;

  /// Asks the module for these, between the polls; absent entries stay without a value. Blocks, at most 20 s. Throws
  /// std::invalid_argument for what is not a number or must not be set in passing (is_volatile_setting), DeviceError
  /// when it is not connected.
  [[nodiscard]] std::vector<Reply> inquire(std::vector<Inquiry> inquiries);

  /// Oldest readings first; one consumer thread. Holds 16384, about 160 s at 50 Hz; further ones are dropped and
  /// counted.
  std::size_t take(std::span<MotorReading> out) { return readings_.pop(out.data(), out.size()); }
  /// What happened, oldest first. 256 are kept. Empty, too, while another thread is at them: they come next time.
  [[nodiscard]] std::vector<StreamEvent> take_events();
  /// False once the port is gone, the module stopped answering or restarted, or a coast stayed unconfirmed.
  [[nodiscard]] bool alive() const noexcept { return alive_; }
  /// Why it is not alive: the newest failure. Without waiting.
  [[nodiscard]] std::string failure() const;
  /// A caller did not renew its command in time. Without waiting.
  [[nodiscard]] bool lease_has_expired() const noexcept { return lease_expiries_ != 0; }
  [[nodiscard]] const std::string& device() const noexcept { return device_; }
  [[nodiscard]] AuditRecord identity() const { return copy_of(identity_); }
  [[nodiscard]] Counters counters() const { return copy_of(counters_); }
  [[nodiscard]] DelayHistogram round_trips() const { return copy_of(round_trips_); }

 private:
  friend class Link;
  friend struct LockOfMotor;  // of a test that stands still in it
  using WallTime = std::chrono::steady_clock::time_point;
  struct Ticket {
    std::uint64_t asked = 0, taken = 0, done = 0;
    [[nodiscard]] bool open() const noexcept { return taken != done; }
  };

  template <class T>
  [[nodiscard]] T copy_of(const T& member) const {
    const std::lock_guard lock(mutex_);
    return member;
  }
  /// Returns a ticket for await_coast.
  std::uint64_t order_coast() noexcept;
  /// False after `wall` or when the link is gone: the motor may still be turning.
  bool await_coast(std::uint64_t ticket, Duration wall) noexcept;
  [[noreturn]] void refuse(const char* operation, const char* next_move) const;
  [[nodiscard]] bool lost() const noexcept { return ended_ || state_ == Session::State::failed; }

  // The link's thread, which waits for nobody.
  /// True: somebody has asked for a coast since.
  [[nodiscard]] bool take_coast() noexcept;
  /// nullopt while a caller is at them: later.
  [[nodiscard]] std::optional<Commands> take_commands();
  void move_readings(Session& session);
  /// Shows callers the state of the session. `line`: there is a port. False while a caller is at it: later.
  [[nodiscard]] bool publish(Session& session, bool line);
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
  Ticket stops_, inquiries_;
  StopReport stop_report_;
  std::vector<Reply> replies_;
  Session::State state_ = Session::State::idle;
  bool line_ = true, ended_ = false;
  std::string failure_;  ///< the newest
  AuditRecord identity_;
  Counters counters_;
  DelayHistogram round_trips_;
  std::vector<StreamEvent> events_;

  std::uint64_t dropped_readings_ = 0, reconnections_ = 0, coasts_taken_ = 0;  ///< the link's thread
  std::atomic<std::uint64_t> coasts_asked_{0}, coasts_done_{0}, lease_expiries_{0};
  std::atomic<std::int64_t> lease_end_ns_{0};  ///< steady_clock
  std::atomic<bool> alive_{true}, has_failed_{false};
  boost::lockfree::spsc_queue<MotorReading> readings_{16384};
  std::unique_ptr<Link> link_;  ///< last: its thread uses the members above
};

}  // namespace kphi::iq
