#include "drivers/sim/iq_device.hpp"

#include <array>
#include <bit>
#include <cmath>

#include "drivers/sim/bytes.hpp"

namespace kphi::sim {
namespace {

enum Code : std::uint8_t { kGet = 0, kSet = 1, kReply = 3 };
constexpr int kBroadcast = 63;
constexpr double kTorqueConstant = 0.0043;  // of the module's own model, N m/A

}  // namespace

IqDevice::IqDevice(const IqSettings& settings, const MotorState& state) : settings_(settings), state_(state) {
  memory_.store(5, 14, settings.module_id);
  tune();
}

void IqDevice::receive(std::span<const std::uint8_t> bytes, Instant now) {
  scanner_.feed(bytes);
  while (const auto frame = scanner_.next()) obey(*frame, now);
}

void IqDevice::obey(const IqFrame& frame, Instant now) {
  if (frame.payload.size() < 2) return;
  const int id = frame.payload[1] >> 2;
  const int code = frame.payload[1] & 3;
  if (code == kReply || (id != kBroadcast && id != static_cast<int>(memory_.value(5, 14)))) return;
  ++frames_;
  restart_timeout(now);
  if (code == kGet && frame.payload.size() == 2 && id != kBroadcast) answer(frame.type, frame.payload[0], now);
  if (code == kSet) set(frame.type, frame.payload[0], frame.payload.subspan(2), now);
}

void IqDevice::answer(std::uint8_t type, std::uint8_t sub, Instant now) {
  if (iq_key(type, sub) == iq_key(88, 1)) return answer_telemetry(now);
  const IqMemory::Cell* cell = memory_.find(type, sub);
  if (cell == nullptr || !cell->entry.get) return;
  std::uint32_t bits = cell->bits;
  double value = 0;
  if (live_value(iq_key(type, sub), now, value)) {
    bits = cell->entry.format == IqFormat::f32 ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                                               : static_cast<std::uint32_t>(value);
  }
  std::array<std::uint8_t, 4> data{};
  put_little(data.data(), bits, 4);
  const auto access = static_cast<std::uint8_t>(static_cast<int>(memory_.value(5, 14)) << 2 | kReply);
  append_iq_frame(output_, type, sub, access, std::span(data).first(iq_size(cell->entry.format)));
}

bool IqDevice::live_value(std::uint16_t key, Instant now, double& value) const noexcept {
  const auto& s = state_;
  switch (key) {
    case iq_key(5, 15):
      value = uptime(now);
      return true;
    case iq_key(50, 0): {
      using Mode = MotorDrive::Mode;
      const bool stage_off = drive_.mode == Mode::coast;
      value = stage_off ? 5 : drive_.mode == Mode::brake ? 4 : drive_.mode == Mode::pwm ? 2 : 3;
      return true;
    }
    case iq_key(50, 8):
      value = s.drive_volts / s.supply_volts;
      return true;
    case iq_key(50, 9):
      value = s.drive_volts;
      return true;
    case iq_key(50, 11):
    case iq_key(69, 0):
      value = s.supply_volts;
      return true;
    case iq_key(50, 12):
      value = s.angle;
      return true;
    case iq_key(50, 13):
      value = s.speed * (1 + settings_.oscillator_gain);
      return true;
    case iq_key(50, 36):
      value = s.motor_amps;
      return true;
    case iq_key(50, 37):
      value = s.motor_amps * kTorqueConstant;
      return true;
    case iq_key(50, 44):
      value = s.speed * kTorqueConstant;
      return true;
    case iq_key(69, 1):
      value = s.supply_amps;
      return true;
    case iq_key(69, 2):
      value = s.supply_amps * s.supply_volts;
      return true;
    case iq_key(69, 3):
      value = s.supply_joules - joules_at_reset_;
      return true;
    case iq_key(73, 0):
      value = s.controller_celsius;
      return true;
    case iq_key(83, 0):
      value = s.coil_celsius;
      return true;
    default:
      return false;
  }
}

void IqDevice::answer_telemetry(Instant now) {
  const auto rounded = [](double value) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(value)));
  };
  std::array<std::uint8_t, 16> data{};
  put_little(data.data(), rounded(state_.controller_celsius * 100), 2);
  put_little(data.data() + 2, rounded(state_.coil_celsius * 100), 2);
  put_little(data.data() + 4, rounded(state_.supply_volts * 100), 2);
  put_little(data.data() + 6, rounded(state_.supply_amps * 100), 2);
  put_little(data.data() + 8, rounded((state_.supply_joules - joules_at_reset_) / state_.supply_volts / 3.6), 2);
  put_little(data.data() + 10, rounded(state_.speed * (1 + settings_.oscillator_gain)), 2);
  put_little(data.data() + 12, static_cast<std::uint32_t>(uptime(now)), 4);
  const auto access = static_cast<std::uint8_t>(static_cast<int>(memory_.value(5, 14)) << 2 | kReply);
  append_iq_frame(output_, 88, 1, access, data);
}

void IqDevice::set(std::uint8_t type, std::uint8_t sub, std::span<const std::uint8_t> data, Instant now) {
  IqMemory::Cell* cell = memory_.find(type, sub);
  if (cell == nullptr || !cell->entry.set || data.size() != iq_size(cell->entry.format)) return;
  cell->bits = little(data);
  act(type, sub, now);
}

void IqDevice::act(std::uint8_t type, std::uint8_t sub, Instant now) {
  using Mode = MotorDrive::Mode;
  const auto spin_as = [&](Mode mode) { spin(mode, memory_.value(type, sub)); };
  switch (iq_key(type, sub)) {
    case iq_key(5, 15):
      time_offset_ = memory_.value(5, 15) - to_seconds(now) * (1 + settings_.oscillator_gain);
      return;
    case iq_key(69, 4):
      joules_at_reset_ = state_.supply_joules;
      return;
    case iq_key(84, 1):
      memory_.store(84, 1, 0);
      return;  // nothing has ever tripped
    case iq_key(52, 1):
      rest(Mode::brake);
      break;
    case iq_key(52, 2):
      rest(Mode::coast);
      break;
    case iq_key(50, 5):
      rest(Mode::brake);
      break;
    case iq_key(50, 6):
      rest(Mode::coast);
      break;
    case iq_key(52, 3):
    case iq_key(50, 3):
      spin_as(Mode::pwm);
      break;
    case iq_key(52, 4):
    case iq_key(50, 4):
      spin_as(Mode::volts);
      break;
    case iq_key(52, 5):
      spin_as(Mode::velocity);
      break;
    default:
      if (type == 52) tune();
      return;
  }
  last_motion_command_ = now;
  if (drive_.mode != Mode::coast && drive_.mode != Mode::brake) {
    timeout_at_ = Instant{0};
    restart_timeout(now);
  }
}

void IqDevice::spin(MotorDrive::Mode mode, double target) noexcept {
  if (!std::isfinite(target)) return rest(MotorDrive::Mode::coast);
  stopping_ = false;
  drive_.mode = mode;
  drive_.target = target;
  memory_.store(52, 0, mode == MotorDrive::Mode::pwm ? 2 : mode == MotorDrive::Mode::volts ? 3 : 4);
}

void IqDevice::rest(MotorDrive::Mode mode) noexcept {
  stopping_ = false;
  drive_.mode = mode;
  drive_.target = 0;
  timeout_at_ = kNever;
  memory_.store(52, 0, mode == MotorDrive::Mode::brake ? 0 : 1);
}

void IqDevice::tune() noexcept {
  const auto finite = [this](std::uint8_t sub) {
    const double value = memory_.value(52, sub);
    return std::isfinite(value) ? value : 0.0;
  };
  drive_.kp = finite(7);
  drive_.ki = finite(8);
  drive_.kd = finite(9);
  drive_.ff0 = finite(10);
  drive_.ff1 = finite(11);
  drive_.ff2 = finite(12);
  drive_.input_filter_hz = finite(16);
}

void IqDevice::restart_timeout(Instant now) noexcept {
  if (timeout_at_ == kNever) return;
  const double seconds = memory_.value(52, 15) * settings_.time_scale;
  constexpr double kYear = 3e7;
  timeout_at_ = now + from_seconds(seconds > 0 ? std::fmin(seconds, kYear) : 0.0);
}

void IqDevice::expire() noexcept {
  ++timeouts_;
  const bool through_zero_volts = memory_.value(52, 18) != 0;
  rest(MotorDrive::Mode::coast);
  if (!through_zero_volts) return;
  spin(MotorDrive::Mode::volts, 0);
  stopping_ = true;
}

void IqDevice::finish_stop() noexcept {
  if (std::abs(state_.speed) >= memory_.value(87, 0)) return;
  rest(memory_.value(52, 18) == 2 ? MotorDrive::Mode::brake : MotorDrive::Mode::coast);
}

double IqDevice::uptime(Instant now) const noexcept {
  return to_seconds(now) * (1 + settings_.oscillator_gain) + time_offset_;
}

}  // namespace kphi::sim
