// What the module does on commands, and by itself: sets, motion, reboots, timeouts.
#include <cmath>

#include "compensation/units.hpp"
#include "drivers/iq/wire/codes.hpp"
#include "drivers/sim/iq/device.hpp"
#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

constexpr double kYear = 3e7;
constexpr Duration kBootTime = std::chrono::milliseconds(150);  // not published

}  // namespace

void IqDevice::set(std::uint8_t type, std::uint8_t sub, std::span<const std::uint8_t> data, Instant now) {
  IqMemory::Cell* cell = memory_.find(type, sub);
  if (cell == nullptr || !cell->entry.set() || data.size() != iq_size(cell->entry.format)) return;
  cell->bits = little(data);
  using Mode = MotorDrive::Mode;
  const double value = cell->value();
  const auto is = [&](std::uint8_t client, std::uint8_t entry) { return type == client && sub == entry; };
  if (is(5, 0)) return brown_out(now, kBootTime);
  if (is(52, 1) || is(50, 5)) return command(Mode::brake, value, now);
  if (is(52, 2) || is(50, 6)) return command(Mode::coast, value, now);
  if (is(52, 3) || is(50, 3)) return command(Mode::pwm, value, now);
  if (is(52, 4) || is(50, 4)) return command(Mode::volts, value, now);
  if (is(52, 5)) return command(Mode::velocity, value, now);
  if (is(84, 1)) return safety_.clear(static_cast<std::uint8_t>(value));
  tune();
}

void IqDevice::save(std::uint8_t type, std::uint8_t sub) noexcept {
  IqMemory::Cell* cell = memory_.find(type, sub);
  if (cell != nullptr && cell->entry.save()) cell->save();
}

void IqDevice::command(MotorDrive::Mode mode, double target, Instant now) noexcept {
  mode == MotorDrive::Mode::brake || mode == MotorDrive::Mode::coast ? rest(mode) : spin(mode, target, now);
  last_motion_ = {now, drive_.mode, drive_.target};
}

void IqDevice::spin(MotorDrive::Mode mode, double target, Instant now) noexcept {
  if (!std::isfinite(target)) return rest(MotorDrive::Mode::coast);
  ending_.cancel();
  drive_.addition = 0;
  drive_.mode = mode;
  drive_.target = target;
  memory_.store(52, 0, mode == MotorDrive::Mode::pwm ? 2 : mode == MotorDrive::Mode::volts ? 3 : 4);
  timeout_at_ = now;
  restart_timeout(now);
}

void IqDevice::rest(MotorDrive::Mode mode) noexcept {
  timeout_at_ = kNever;
  memory_.store(52, 0, mode == MotorDrive::Mode::brake ? 0 : 1);
  if (ending_.endless()) return;
  ending_.cancel();
  drive_.addition = 0;
  drive_.mode = mode;
  drive_.target = 0;
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
  if (!settings_.quirks.no_volts_limit) limits_.volts_limit = memory_.finite(50, 35);
  limits_.redline_start = upset_.redline.value_or(memory_.finite(50, 38));
  limits_.redline_end = upset_.redline ? 1.03 * *upset_.redline : memory_.finite(50, 39);
  limits_.slew = memory_.value(50, 47) != 0 ? memory_.finite(50, 46) : 0;
  line_rate_ = memory_.value(16, 0) * (1 + settings_.oscillator_gain);
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
  tune();
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
  scanner_.clear();
  replies_.clear();
  busy_until_ = now;
  booted_ = now;
  ending_ = {};
  control_ = {};
  drive_ = {};
  safety_.power_up();
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
  const bool as_disarming = meaning == static_cast<int>(iq::TimeoutMeaning::disarm_behavior);
  const int behavior = static_cast<int>(as_disarming ? memory_.value(86, 9) : memory_.value(52, 18));
  const int song = static_cast<int>(as_disarming ? memory_.value(86, 10) : memory_.value(52, 19));
  const int played = settings_.quirks.legacy ? static_cast<int>(iq::SongOption::continuously) : song;
  rest(MotorDrive::Mode::coast);
  ending_.begin({behavior, played, memory_.finite(87, 0), memory_.finite(87, 1)}, now);
  ending_.step(state_->speed, now, drive_);
}

}  // namespace kphi::sim
