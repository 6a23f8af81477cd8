// The other end of the motor's wire: an IQ2306 speed module as bytes in and replies out. No port, clock or thread.
// SETs are never answered, GETs in the order they came; unknown entries, wrong lengths and other ids get no
// answer. What the documents leave open: IqQuirks.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/clock.hpp"
#include "drivers/sim/iq/control.hpp"
#include "drivers/sim/iq/entries.hpp"
#include "drivers/sim/iq/frame.hpp"
#include "drivers/sim/iq/sensors.hpp"
#include "drivers/sim/physics/motor.hpp"

namespace kphi::sim {

struct IqSettings {
  int module_id = 0;               ///< 0..62
  double oscillator_gain = 0.005;  ///< relative error of the module's clock: time and baud run as 1 + gain, a speed
                                   ///< reads speed / (1 + gain) and is controlled to the command times 1 + gain
  double time_scale = 1;   ///< bench seconds per wall second: the communication timeout and the replies' latency last
                           ///< this many times longer
  unsigned baud = 115200;  ///< saved
  IqQuirks quirks;
  IqSensorErrors sensors;
  Duration reply_latency{0};  ///< from the end of a question to the reply, wall time; the module does one at a time
  Duration reply_jitter{0};   ///< up to this much more
  double timeout_s = 0.5;     ///< saved
  std::array<std::uint32_t, 3> uid{0x00230006, 0x4d4b5011, 0x20343353};
  std::uint64_t seed = 1;
  Instant begin{0};  ///< when it is switched on
};

/// One reply as the firmware meant it.
struct IqReply {
  Instant asked{0};  ///< when the question was read: the time of the value
  Instant at{0};     ///< earliest time of its first byte
  std::uint8_t type = 0, sub = 0, id = 0;
  std::uint8_t size = 0;
  std::array<std::uint8_t, 16> bytes{};
  double truth = std::numeric_limits<double>::quiet_NaN();  ///< reading of a perfect sensor; NaN: not a measured value

  [[nodiscard]] std::span<const std::uint8_t> data() const noexcept { return std::span(bytes).first(size); }
};

/// A command that spins, brakes or coasts, as the module understood it.
struct IqMotion {
  Instant at{0};
  MotorDrive::Mode mode = MotorDrive::Mode::coast;
  double target = 0;
};

/// What a script of faults does to the module itself.
struct IqUpset {
  IqHeat heat;
  bool deaf_to_sets = false;
  std::optional<double> redline;  ///< rad/s: where the derate begins; it ends 3 % later
};

class IqDevice {
 public:
  /// `state` must outlive the device.
  IqDevice(const IqSettings& settings, const MotorState& state);

  /// Bytes that arrive at `now`, which is not before that of an earlier call.
  void receive(std::span<const std::uint8_t> bytes, Instant now);
  /// One tick of the firmware: timeout, safety, sensors, control.
  void advance(Instant now) noexcept;
  /// Next reply that is ready at `now`.
  bool next_reply(IqReply& out, Instant now);
  /// When next_reply() will have one; kNever when no question waits.
  [[nodiscard]] Instant next_reply_at() const noexcept { return replies_.empty() ? kNever : replies_.front().at; }
  /// The replies as bytes, oldest first, for joining a driver without the line. The caller empties it.
  [[nodiscard]] std::vector<std::uint8_t>& output();

  /// Off for `down`, then as after power-up; what was not saved is lost.
  void brown_out(Instant now, Duration down);
  /// Another module of the same kind is plugged in.
  void replace(const std::array<std::uint32_t, 3>& uid) noexcept;
  /// Sets and saves the line's rate, at once.
  void set_baud(unsigned baud) noexcept;
  void upset(const IqUpset& upset) noexcept;

  /// Bits per second on the wire, as a perfect clock would count them.
  [[nodiscard]] double line_rate() const noexcept { return line_rate_; }
  [[nodiscard]] const MotorDrive& drive() const noexcept { return drive_; }
  [[nodiscard]] const PowerStage& stage() const noexcept { return stage_; }
  [[nodiscard]] bool singing() const noexcept { return ending_.singing(); }
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::uint64_t timeouts() const noexcept { return timeouts_; }
  [[nodiscard]] std::uint64_t boots() const noexcept { return boots_; }
  /// Bench time -1 ns before the first.
  [[nodiscard]] const IqMotion& last_motion() const noexcept { return last_motion_; }

 private:
  // Frames.
  void attend(Instant now);
  void apply(const IqFrame& frame, Instant now);
  [[nodiscard]] bool is_mine(int id, std::uint8_t type) const noexcept;
  void answer(std::uint8_t type, std::uint8_t sub, Instant now);
  void set(std::uint8_t type, std::uint8_t sub, std::span<const std::uint8_t> data, Instant now);
  void save(std::uint8_t type, std::uint8_t sub) noexcept;
  /// The value of an entry that follows the physics, by these readings.
  [[nodiscard]] std::optional<double> live_value(std::uint16_t key, const IqReadings& readings,
                                                 Instant now) const noexcept;
  [[nodiscard]] int drive_mode() const noexcept;

  // Actions.
  void command(MotorDrive::Mode mode, double target, Instant now) noexcept;
  void spin(MotorDrive::Mode mode, double target, Instant now) noexcept;
  void rest(MotorDrive::Mode mode) noexcept;
  void tune() noexcept;
  void boot(Instant now);

  // Time.
  void expire(Instant now) noexcept;
  void restart_timeout(Instant now) noexcept;

  IqSettings settings_;
  const MotorState* state_;
  IqMemory memory_;
  IqScanner scanner_;
  IqSensors sensors_;
  IqSafety safety_;
  IqControl control_;
  IqEnding ending_;
  IqLimits limits_;
  IqUpset upset_;
  Random random_;
  MotorDrive drive_;
  PowerStage stage_;

  std::deque<IqReply> replies_;
  std::vector<std::uint8_t> output_;
  Instant heard_{0};       ///< latest time passed to it
  Instant busy_until_{0};  ///< with a question
  Instant off_until_{0};
  bool asleep_ = false;  // since its power went
  double line_rate_ = 0;
  Instant booted_{0};
  Instant timeout_at_ = kNever;
  IqMotion last_motion_{Instant{-1}, MotorDrive::Mode::coast, 0};
  std::uint64_t frames_ = 0;
  std::uint64_t timeouts_ = 0;
  std::uint64_t boots_ = 0;
  std::uint64_t ticks_ = 0;
};

}  // namespace kphi::sim
