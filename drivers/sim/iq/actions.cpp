// What the module does on commands, and by itself: sets, motion, flash, reboots, timeouts.
#include <algorithm>
#include <cmath>
#include <utility>

#include "compensation/units.hpp"
#include "drivers/iq/wire/codes.hpp"
#include "drivers/sim/iq/device.hpp"
#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

constexpr std::uint32_t kFormatKey1 = 12345678, kFormatKey2 = 11223344;
constexpr double kYear = 3e7;
constexpr Duration kBootTime = std::chrono::milliseconds(150);  // not published
constexpr double kSlowestBaud = 300;

}  // namespace

void IqDevice::set(std::uint8_t type, std::uint8_t sub, std::span<const std::uint8_t> data, Instant now) {
  IqMemory::Cell* cell = memory_.find(type, sub);
  if (cell == nullptr || !cell->entry.set() || data.size() != iq_size(cell->entry.format)) return;
  cell->bits = little(data);
  act(type, sub, now);
}

void IqDevice::save(std::uint8_t type, std::uint8_t sub) noexcept {
  IqMemory::Cell* cell = memory_.find(type, sub);
  if (cell != nullptr && cell->entry.save()) cell->save();
}

void IqDevice::act(std::uint8_t type, std::uint8_t sub, Instant now) {
  if (command_motion(type, sub, now)) return;
  const double value = memory_.value(type, sub);
  switch (type) {
    case 5:
      return system_action(sub, now);
    case 11:
      return flash_action(sub);
    case 16: {
      IqMemory::Cell* cell = memory_.find(16, 0);
      cell->save();
      baud_ = static_cast<unsigned>(std::max(value, kSlowestBaud));
      return;
    }
    case 69:
      if (sub == 4) sensors_.reset_joules(*state_);
      break;
    case 84:
      if (sub == 1) safety_.clear(static_cast<std::uint8_t>(value));
      return;
    case 86:
      if (sub == 12) arm(value != 0, now);
      return;
    default:
      break;
  }
  tune();
}

void IqDevice::system_action(std::uint8_t sub, Instant now) {
  if (sub == 0) return brown_out(now, kBootTime);
  if (sub == 1) {
    in_boot_loader_ = true;
    replies_.clear();
    rest(MotorDrive::Mode::coast, now);
    stage_ = {};
  }
  if (sub == 15) time_offset_ = memory_.finite(5, 15) - to_seconds(now - booted_) * (1 + settings_.oscillator_gain);
}

void IqDevice::flash_action(std::uint8_t sub) noexcept {
  if (sub > 1) return;
  const bool allowed = static_cast<std::uint32_t>(memory_.value(11, 2)) == kFormatKey1 &&
                       static_cast<std::uint32_t>(memory_.value(11, 3)) == kFormatKey2;
  if (!allowed) return;
  if (sub == 0) memory_.erase();
  if (sub == 1) memory_.revert();
  memory_.store(11, 2, 0);
  memory_.store(11, 3, 0);
  tune();
}

/// False: the entry does not command motion.
bool IqDevice::command_motion(std::uint8_t type, std::uint8_t sub, Instant now) {
  using Mode = MotorDrive::Mode;
  const double value = memory_.value(type, sub);
  switch (iq_key(type, sub)) {
    case iq_key(52, 1):
    case iq_key(50, 5):
      rest(Mode::brake, now);
      break;
    case iq_key(52, 2):
    case iq_key(50, 6):
      rest(Mode::coast, now);
      break;
    case iq_key(52, 3):
    case iq_key(50, 3):
      spin(Mode::pwm, value, now);
      break;
    case iq_key(52, 4):
    case iq_key(50, 4):
      spin(Mode::volts, value, now);
      break;
    case iq_key(50, 1):
    case iq_key(50, 2):
      spin(Mode::volts, 0, now);  // one phase, open loop: it heats and holds
      break;
    case iq_key(52, 5):
      spin(Mode::velocity, value, now);
      break;
    default:
      return false;
  }
  last_motion_ = {now, drive_.mode, drive_.target};
  return true;
}

void IqDevice::spin(MotorDrive::Mode mode, double target, Instant now) noexcept {
  if (!std::isfinite(target)) return rest(MotorDrive::Mode::coast, now);
  ending_.cancel();
  drive_.addition = memory_.finite(50, 21);
  drive_.mode = mode;
  drive_.target = target;
  memory_.store(52, 0, mode == MotorDrive::Mode::pwm ? 2 : mode == MotorDrive::Mode::volts ? 3 : 4);
  timeout_at_ = now;
  restart_timeout(now);
}

void IqDevice::rest(MotorDrive::Mode mode, Instant) noexcept {
  timeout_at_ = kNever;
  memory_.store(52, 0, mode == MotorDrive::Mode::brake ? 0 : 1);
  if (ending_.endless()) return;
  ending_.cancel();
  drive_.addition = 0;
  drive_.mode = mode;
  drive_.target = 0;
}

/// A velocity, a voltage and a PWM need no arming; it ends an endless song.
void IqDevice::arm(bool armed, Instant now) noexcept {
  if (armed == std::exchange(armed_, armed)) return;
  if (armed && ending_.endless()) {
    ending_.cancel();
    rest(MotorDrive::Mode::coast, now);
  }
  if (!armed) end_motion(static_cast<int>(memory_.value(86, 9)), static_cast<int>(memory_.value(86, 10)), now);
}

void IqDevice::tune() noexcept {
  drive_.kp = memory_.finite(52, 7);
  drive_.ki = memory_.finite(52, 8);
  drive_.kd = memory_.finite(52, 9);
  drive_.ff0 = memory_.finite(52, 10);
  drive_.ff1 = memory_.finite(52, 11);
  drive_.ff2 = memory_.finite(52, 12);
  drive_.input_filter_hz = memory_.finite(52, 16);
  const double kv = memory_.finite(50, 32);
  limits_.emf_constant = kv > 0 ? 60 / (2 * kPi * kv) : 0;
  limits_.resistance = memory_.finite(50, 33);
  limits_.amps_max = memory_.finite(50, 34);
  limits_.amps_soft_start = memory_.finite(50, 42);
  limits_.amps_soft_end = memory_.finite(50, 43);
  limits_.volts_start = memory_.finite(50, 29);
  limits_.volts_limit = memory_.finite(50, 35);
  limits_.redline_start = upset_.redline.value_or(memory_.finite(50, 38));
  limits_.redline_end = upset_.redline ? 1.03 * *upset_.redline : memory_.finite(50, 39);
  limits_.slew = memory_.value(50, 47) != 0 ? memory_.finite(50, 46) : 0;
  sensors_.tune(memory_);
}

void IqDevice::upset(const IqUpset& upset) noexcept {
  upset_ = upset;
  sensors_.heat(upset.heat);
  tune();
}

void IqDevice::replace(const std::array<std::uint32_t, 3>& uid) noexcept {
  for (std::uint8_t i = 0; i < 3; ++i) memory_.provide(5, static_cast<std::uint8_t>(4 + i), uid[i]);
}

void IqDevice::set_baud(unsigned baud) noexcept {
  memory_.provide(16, 0, baud);
  baud_ = baud;
}

void IqDevice::brown_out(Instant now, Duration down) {
  off_until_ = now + down;
  asleep_ = true;
  stage_ = {};
  boot(off_until_);
}

void IqDevice::boot(Instant now) {
  ++boots_;
  memory_.reboot();
  baud_ = static_cast<unsigned>(std::max(memory_.value(16, 0), kSlowestBaud));
  scanner_.clear();
  replies_.clear();
  busy_until_ = now;
  booted_ = now;
  time_offset_ = 0;
  in_boot_loader_ = false;
  ending_ = {};
  control_ = {};
  drive_ = {};
  safety_.power_up();
  armed_ = memory_.value(86, 1) != 0;  // always_armed
  timeout_at_ = kNever;
  memory_.store(52, 0, 1);
  tune();
  sensors_.restart(memory_, *state_);
}

void IqDevice::restart_timeout(Instant now) noexcept {
  if (timeout_at_ == kNever) return;
  const double seconds = memory_.value(52, 15) * settings_.time_scale / (1 + settings_.oscillator_gain);
  timeout_at_ = now + from_seconds(seconds > 0 ? std::fmin(seconds, kYear) : 0.0);
}

void IqDevice::expire(Instant now) noexcept {
  ++timeouts_;
  const int meaning = static_cast<int>(memory_.value(52, 17));
  if (meaning != static_cast<int>(iq::TimeoutMeaning::error_stay_armed)) armed_ = false;
  const bool as_disarming = meaning == static_cast<int>(iq::TimeoutMeaning::disarm_behavior);
  const int behavior = static_cast<int>(as_disarming ? memory_.value(86, 9) : memory_.value(52, 18));
  const int song = static_cast<int>(as_disarming ? memory_.value(86, 10) : memory_.value(52, 19));
  end_motion(behavior, settings_.quirks.legacy ? static_cast<int>(iq::SongOption::continuously) : song, now);
}

void IqDevice::end_motion(int behavior, int song, Instant now) noexcept {
  rest(MotorDrive::Mode::coast, now);
  ending_.begin({behavior, song, memory_.finite(87, 0), memory_.finite(87, 1)}, now);
  ending_.step(state_->speed, now, drive_);
}

}  // namespace kphi::sim
