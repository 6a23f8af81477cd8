// The other end of the motor's wire: an IQ2306 speed module as bytes in and bytes out. No port, clock or thread.
// SETs are never answered, GETs in the order they came; unknown entries, wrong lengths and other ids are met with
// silence. Open questions of the protocol are answered as the facts suggest: a GET resets the communication timeout, a
// broadcast SET acts, a broadcast GET is not answered. Not in this version: save and reboot, throttle commands,
// derating, the song.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/sim/iq_entries.hpp"
#include "drivers/sim/iq_frame.hpp"
#include "drivers/sim/motor.hpp"

namespace kphi::sim {

struct IqSettings {
  int module_id = 0;           ///< 0..62
  double oscillator_gain = 0;  ///< relative error of the module's clock: reported speed reads speed * (1 + gain).
                               ///< Default none in this version; a real module has no crystal.
  double time_scale = 1;  ///< bench seconds per wall second: the communication timeout lasts this many times longer
};

class IqDevice {
 public:
  /// `state` must outlive the device.
  IqDevice(const IqSettings& settings, const MotorState& state);

  void receive(std::span<const std::uint8_t> bytes, Instant now);
  /// Lets the communication timeout expire; call it every tick.
  void advance(Instant now) noexcept {
    if (now >= timeout_at_) expire();
    if (stopping_) finish_stop();
  }
  /// Bytes to send, oldest first. The caller empties it.
  [[nodiscard]] std::vector<std::uint8_t>& output() noexcept { return output_; }

  [[nodiscard]] const MotorDrive& drive() const noexcept { return drive_; }
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::uint64_t crc_errors() const noexcept { return scanner_.crc_errors(); }
  [[nodiscard]] std::uint64_t timeouts() const noexcept { return timeouts_; }
  /// Bench time of the last command that spins, brakes or coasts; -1 ns before the first.
  [[nodiscard]] Instant last_motion_command() const noexcept { return last_motion_command_; }

 private:
  void obey(const IqFrame& frame, Instant now);
  void answer(std::uint8_t type, std::uint8_t sub, Instant now);
  void set(std::uint8_t type, std::uint8_t sub, std::span<const std::uint8_t> data, Instant now);
  void act(std::uint8_t type, std::uint8_t sub, Instant now);
  void spin(MotorDrive::Mode mode, double target) noexcept;
  void rest(MotorDrive::Mode mode) noexcept;
  void tune() noexcept;
  void expire() noexcept;
  void finish_stop() noexcept;
  void restart_timeout(Instant now) noexcept;
  [[nodiscard]] double uptime(Instant now) const noexcept;
  /// The value of an entry that follows the physics.
  [[nodiscard]] bool live_value(std::uint16_t key, Instant now, double& value) const noexcept;
  void answer_telemetry(Instant now);

  IqSettings settings_;
  const MotorState& state_;
  IqMemory memory_;
  IqScanner scanner_;
  std::vector<std::uint8_t> output_;
  MotorDrive drive_;
  bool stopping_ = false;  ///< at 0 V until slow, then the final state of the timeout
  double joules_at_reset_ = 0;
  double time_offset_ = 0;
  Instant timeout_at_ = kNever;
  Instant last_motion_command_{-1};
  std::uint64_t frames_ = 0;
  std::uint64_t timeouts_ = 0;
};

}  // namespace kphi::sim
