// The motor module on a serial port: one session, pumped by a thread of its own.
//
// Safety. The motor coasts: when asked, from any thread; when nobody has called spin_at or renew for 0.5 s of wall
// time although polling goes on; when the module or the port fails; when the thread ends for whatever reason; and when
// the object dies. If this process dies without a word, the module's own communication timeout coasts it.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "drivers/iq/session.hpp"

namespace kphi::iq {

class Link;

class Motor {
 public:
  /// Time the host grants its own caller between two signs of life while the motor spins, wall time.
  static constexpr Duration kLease = std::chrono::milliseconds(500);

  /// Opens the port exclusively and connects (coasting first); blocks for at most 10 s, usually some 50 ms. Deadlines
  /// of the protocol are wall time: `settings.reply_timeout` 0 becomes clock.stretched(100 ms), wire_byte_time 0
  /// becomes 10/baud. module_timeout_s goes to the module as it is: its seconds are its own. Throws DeviceError: port
  /// missing, forbidden or in use, no module answers, the module refused its communication timeout. `clock` must
  /// outlive the motor.
  Motor(std::string device, unsigned baud, Settings settings, const Clock& clock);
  /// Coasts three times, waits at most 0.6 s for drive mode coast, closes.
  ~Motor();
  Motor(const Motor&) = delete;
  Motor& operator=(const Motor&) = delete;

  /// Any thread; renews the lease. + = counter-clockwise, zero coasts. Throws std::invalid_argument beyond
  /// ±3450 rad/s, DeviceError when the motor is no longer alive. Of commands that meet before the wire the last wins.
  void spin_at(RadPerSec signed_speed);
  /// Any thread: the caller is alive. Never restarts a motor that has been coasted.
  void renew() noexcept;
  /// Any thread. A spin_at that returned before is overruled.
  void coast() noexcept;
  /// Any thread: coasts, and waits for the module to report drive mode coast. False after `wall` or when the link is
  /// gone: the motor may still be turning.
  [[nodiscard]] bool coast_and_confirm(Duration wall) noexcept;

  /// Oldest readings first; one consumer thread. Holds 16384, about 160 s at 50 Hz; further ones are dropped and
  /// counted.
  std::size_t take(std::span<Reading> out);
  /// False once the port is gone, the module stopped answering, or a coast stayed unconfirmed; it stays false.
  [[nodiscard]] bool alive() const noexcept;
  /// Why it is not alive.
  [[nodiscard]] std::string failure() const;
  [[nodiscard]] const std::string& device() const noexcept;
  [[nodiscard]] Identity identity() const;
  [[nodiscard]] Counters counters() const;
  /// Bench time of the newest reading; any thread.
  [[nodiscard]] Instant newest_reading() const noexcept;

 private:
  std::unique_ptr<Link> link_;
};

}  // namespace kphi::iq
