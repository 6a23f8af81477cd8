// The motor module on a serial port: one session, pumped by a thread of its own.
//
// Safety. The motor coasts: when asked, from any thread; when nobody has called spin_at or renew for 0.5 s of wall
// time although polling goes on; when the module or the port fails; when the module has restarted by itself; when the
// thread ends for whatever reason; and when the object dies. If this process dies without a word, the module's own
// communication timeout coasts it.
//
// After a failure the link looks for the port and the module by itself, and coasts what it finds. The motor spins again
// only when its owner has seen the failure and says rearm().
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/iq/session.hpp"

namespace kphi::iq {

class Link;
class Seat;

class Motor {
 public:
  /// Time the host grants its own caller between two signs of life while the motor spins, wall time.
  static constexpr Duration kLease = std::chrono::milliseconds(500);

  /// Opens the port exclusively and connects (coasting first); blocks for at most 10 s, usually some 50 ms. Deadlines
  /// of the protocol are wall time: `settings.reply_timeout` 0 becomes clock.stretched(100 ms), wire_byte_time 0
  /// becomes 10/baud. module_timeout_s goes to the module as it is: its seconds are its own. Throws DeviceError: port
  /// missing, forbidden or in use, no module answers, the module refused its communication timeout. `device` had best
  /// be a name that stays (/dev/serial/by-id/…): it is opened again after the port was lost. `clock` must outlive the
  /// motor. `capture`: a file for all bytes of the line (capture.hpp); empty: none.
  Motor(std::string device, unsigned baud, Settings settings, const Clock& clock, const std::string& capture = {});
  /// Coasts three times, waits at most 0.6 s for drive mode coast, closes.
  ~Motor();
  Motor(const Motor&) = delete;
  Motor& operator=(const Motor&) = delete;

  /// Several modules on one line, in the order of `modules`; ids must differ. A module that fails or does not confirm a
  /// coast stops the others. Throws as the constructor does.
  [[nodiscard]] static std::vector<std::unique_ptr<Motor>> on_one_line(const std::string& device, unsigned baud,
                                                                       const std::vector<Settings>& modules,
                                                                       const Clock& clock,
                                                                       const std::string& capture = {});

  /// Any thread; renews the lease. + = counter-clockwise, zero coasts. Throws std::invalid_argument beyond
  /// ±3450 rad/s, DeviceError when the motor is not alive. Of commands that meet before the wire the last wins.
  void spin_at(RadPerSec signed_speed);
  /// Any thread: the caller is alive. Never restarts a motor that has been coasted.
  void renew() noexcept;
  /// Any thread. A spin_at that returned before is overruled.
  void coast() noexcept;
  /// Any thread: as coast, three times at once.
  void emergency_stop() noexcept;
  /// Any thread: coasts, and waits for the module to report drive mode coast. False after `wall` or when the link is
  /// gone: the motor may still be turning.
  [[nodiscard]] bool coast_and_confirm(Duration wall) noexcept;
  /// Any thread: ramps down, coasts, and waits until the motor stands or the settings' limit is over; keeps the lease
  /// meanwhile. Throws std::invalid_argument for settings that make no sense. Always ends coasting.
  [[nodiscard]] StopReport stop(const StopSettings& settings = {});

  /// Asks the module for these, between the polls; absent entries stay without a value. Blocks, at most 20 s. Throws
  /// std::invalid_argument for what is no number or may not be set in passing (is_volatile_setting), DeviceError when
  /// it is not connected.
  [[nodiscard]] std::vector<Reply> inquire(std::vector<Inquiry> inquiries);

  /// Oldest readings first; one consumer thread. Holds 16384, about 160 s at 50 Hz; further ones are dropped and
  /// counted.
  std::size_t take(std::span<Reading> out);
  /// What happened, oldest first; any thread. 256 are kept.
  [[nodiscard]] std::vector<Event> take_events();
  /// False once the port is gone, the module stopped answering or restarted, or a coast stayed unconfirmed; true again
  /// only after rearm().
  [[nodiscard]] bool alive() const noexcept;
  /// The module answers and coasts or obeys: what rearm() needs.
  [[nodiscard]] bool connected() const;
  /// The owner has seen the failure: the motor may spin again. Throws DeviceError unless connected.
  void rearm();
  /// Why it is not alive: the newest failure since the last rearm().
  [[nodiscard]] std::string failure() const;
  [[nodiscard]] const std::string& device() const noexcept;
  [[nodiscard]] Identity identity() const;
  [[nodiscard]] Counters counters() const;
  [[nodiscard]] RoundTripHistogram round_trips() const;
  /// Bench time of the newest reading; any thread.
  [[nodiscard]] Instant newest_reading() const noexcept;

 private:
  Motor(std::shared_ptr<Link> link, std::size_t seat);

  std::shared_ptr<Link> link_;
  Seat& seat_;
};

}  // namespace kphi::iq
