#include "drivers/sim/iq/device.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/iq/wire/codes.hpp"
#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

enum Code : std::uint8_t { kGet = 0, kSet = 1, kSave = 2, kReply = 3 };
constexpr int kBroadcast = static_cast<int>(iq::ModuleId::broadcast);
constexpr std::uint8_t kSystemControl = static_cast<std::uint8_t>(iq::Client::system_control);
constexpr std::size_t kReceiveBuffer = 64;  // bytes; what comes while it is full is lost
constexpr int kTicksPerSafety = 7;          // every millisecond
constexpr double kFix16 = 65536;
constexpr double kBrownOutVolts = 3.2;  // of the input: the controller holds no longer
constexpr Duration kBrownOut = std::chrono::milliseconds(50);

/// Entries that are a reading as it is.
struct LiveReading {
  std::uint16_t key;
  double IqReadings::*reading;
};
using R = IqReadings;
constexpr LiveReading kLiveReadings[] = {{iq_key(50, 11), &R::volts},
                                         {iq_key(50, 12), &R::angle},
                                         {iq_key(50, 13), &R::speed},
                                         {iq_key(50, 23), &R::emf},
                                         {iq_key(50, 36), &R::motor_amps},
                                         {iq_key(50, 37), &R::motor_torque},
                                         {iq_key(50, 44), &R::emf},
                                         {iq_key(69, 0), &R::volts},
                                         {iq_key(69, 1), &R::amps},
                                         {iq_key(69, 3), &R::joules},
                                         {iq_key(69, 7), &R::volts_raw},
                                         {iq_key(69, 8), &R::amps_raw},
                                         {iq_key(69, 13), &R::volts_cascaded},
                                         {iq_key(73, 0), &R::controller_celsius},
                                         {iq_key(77, 0), &R::coil_celsius},
                                         {iq_key(83, 0), &R::coil_celsius},
                                         {iq_key(83, 1), &R::stator_celsius},
                                         {iq_key(83, 5), &R::forced_convection},
                                         {iq_key(83, 11), &R::joule_watts},
                                         {iq_key(83, 12), &R::convection_watts},
                                         {iq_key(83, 13), &R::conduction_watts}};

}  // namespace

IqDevice::IqDevice(const IqSettings& settings, const MotorState& state)
    : settings_(settings),
      state_(&state),
      memory_(settings.quirks),
      scanner_(kReceiveBuffer),
      sensors_(settings.sensors, settings.oscillator_gain, settings.seed),
      random_(~settings.seed),
      baud_(settings.baud) {
  memory_.provide(5, 14, settings.module_id);
  memory_.provide(16, 0, settings.baud);
  memory_.provide(52, 15, settings.timeout_s);
  replace(settings.uid);
  boot(settings.begin);
}

void IqDevice::receive(std::span<const std::uint8_t> bytes, Instant now) {
  heard_ = std::max(heard_, now);
  if (now < off_until_ || in_boot_loader_) return;
  attend(now);
  while (!bytes.empty()) {
    const std::size_t taken = scanner_.feed(bytes);
    bytes = bytes.subspan(taken);
    const std::uint64_t before = frames_ + scanner_.crc_errors();
    attend(now);
    if (now < off_until_ || in_boot_loader_) return;
    if (taken == 0 && before == frames_ + scanner_.crc_errors()) break;
  }
  overflowed_ += bytes.size();
}

void IqDevice::advance(Instant now) noexcept {
  heard_ = std::max(heard_, now);
  if (now < off_until_ || in_boot_loader_) {
    stage_ = {};
    return;
  }
  if (state_->supply_volts < kBrownOutVolts) return brown_out(now, kBrownOut);
  // Its filters begin with what is there when it wakes, not when its power went.
  if (std::exchange(asleep_, false)) sensors_.restart(memory_, *state_);
  attend(now);
  sensors_.step(*state_);
  if (now >= timeout_at_) expire(now);
  if (ending_.going_on()) {
    ending_.step(state_->speed, now, drive_);
    if (!ending_.going_on()) memory_.store(52, 0, drive_.mode == MotorDrive::Mode::brake ? 0 : 1);
  }
  if (++ticks_to_safety_ >= kTicksPerSafety) {
    ticks_to_safety_ = 0;
    const IqReadings readings = sensors_.readings(*state_);
    if (safety_.check(memory_, readings) && memory_.value(84, 2) != 0) rest(MotorDrive::Mode::coast, now);
    const bool legacy = settings_.quirks.legacy;
    const double coil = derate_between(memory_.value(legacy ? 77 : 83, legacy ? 1 : 8),
                                       memory_.value(legacy ? 77 : 83, legacy ? 2 : 9), readings.coil_celsius);
    limits_.thermal = coil * derate_between(memory_.value(73, 3), memory_.value(73, 4), readings.controller_celsius);
  }
  const IqSensed sensed{state_->speed / (1 + settings_.oscillator_gain), state_->supply_volts};
  stage_ = control_.step(safety_.safe_mode() ? MotorDrive{} : drive_, limits_, sensed);
}

bool IqDevice::next_reply(IqReply& out, Instant now) {
  if (now >= off_until_ && !in_boot_loader_) attend(now);
  if (replies_.empty() || replies_.front().at > now) return false;
  out = replies_.front();
  replies_.pop_front();
  return true;
}

std::vector<std::uint8_t>& IqDevice::output() {
  IqReply reply;
  while (next_reply(reply, heard_))
    append_iq_frame(output_, reply.type, reply.sub, static_cast<std::uint8_t>(reply.id << 2 | kReply), reply.data());
  return output_;
}

/// One question at a time; what has not been read yet stays in the buffer.
void IqDevice::attend(Instant now) {
  while (busy_until_ <= now) {
    const auto frame = scanner_.next();
    if (!frame) return;
    apply(*frame, std::max(busy_until_, std::min(now, heard_)));
    if (now < off_until_ || in_boot_loader_) return;
  }
}

bool IqDevice::is_mine(int id, std::uint8_t type) const noexcept {
  if (id == kBroadcast) return true;
  if (settings_.quirks.system_control_on_id_zero && type == kSystemControl) return id == 0;
  return id == static_cast<int>(memory_.value(5, 14));
}

void IqDevice::apply(const IqFrame& frame, Instant now) {
  if (frame.payload.size() < 2) return;
  const int id = frame.payload[1] >> 2;
  const int code = frame.payload[1] & 3;
  const bool deaf = upset_.deaf_to_sets && code != kGet;
  if (code == kReply || deaf || !is_mine(id, frame.type)) return;
  restart_timeout(now);
  ++frames_;
  const std::uint8_t sub = frame.payload[0];
  const auto data = frame.payload.subspan(2);
  if (code == kGet && data.empty() && id != kBroadcast) answer(frame.type, sub, now);
  if (code == kSet) set(frame.type, sub, data, now);
  if (code == kSave && data.empty()) save(frame.type, sub);
}

void IqDevice::answer(std::uint8_t type, std::uint8_t sub, Instant now) {
  const IqMemory::Cell* cell = memory_.find(type, sub);
  if (cell == nullptr || !cell->entry.get()) return;
  std::uint32_t bits = cell->bits;
  double truth = std::numeric_limits<double>::quiet_NaN();
  if (const auto value = live_value(iq_key(type, sub), sensors_.readings(*state_), now)) {
    bits = iq_bits(cell->entry.format, *value);
    truth = live_value(iq_key(type, sub), true_readings(), now).value_or(truth);
  }
  std::array<std::uint8_t, 4> data{};
  put_little(data.data(), bits, 4);
  reply(type, sub, std::span(data).first(iq_size(cell->entry.format)), truth, now);
}

void IqDevice::reply(std::uint8_t type, std::uint8_t sub, std::span<const std::uint8_t> data, double truth,
                     Instant now) {
  const bool on_zero = settings_.quirks.system_control_on_id_zero && type == kSystemControl;
  IqReply reply;
  reply.asked = now;
  const double jitter = 0.5 * (random_.symmetric() + 1) * to_seconds(settings_.reply_jitter);
  reply.at = now + from_seconds((to_seconds(settings_.reply_latency) + jitter) * settings_.time_scale);
  reply.type = type;
  reply.sub = sub;
  reply.id = on_zero ? 0 : static_cast<std::uint8_t>(memory_.value(5, 14));
  reply.size = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), reply.bytes.begin());
  reply.truth = truth;
  busy_until_ = reply.at;
  replies_.push_back(reply);
}

IqReadings IqDevice::true_readings() const noexcept {
  IqReadings r = sensors_.readings(*state_);
  r.speed = state_->speed;
  r.volts = r.volts_cascaded = state_->supply_volts;
  r.amps = state_->supply_amps;
  r.controller_celsius = state_->controller_celsius;
  r.coil_celsius = state_->coil_celsius;
  r.stator_celsius = state_->stator_celsius;
  r.motor_amps = state_->motor_amps;
  return r;
}

int IqDevice::drive_mode() const noexcept {
  using Mode = MotorDrive::Mode;
  using iq::DriveMode;
  if (safety_.safe_mode()) return static_cast<int>(DriveMode::coast);
  if (ending_.singing()) return static_cast<int>(DriveMode::phase_volts);
  if (drive_.mode == Mode::coast) return static_cast<int>(DriveMode::coast);
  if (drive_.mode == Mode::brake) return static_cast<int>(DriveMode::brake);
  return static_cast<int>(drive_.mode == Mode::pwm ? DriveMode::spin_pwm : DriveMode::spin_volts);
}

std::optional<double> IqDevice::live_value(std::uint16_t key, const IqReadings& r, Instant now) const noexcept {
  for (const LiveReading& row : kLiveReadings) {
    if (row.key == key) return r.*row.reading;
  }
  switch (key) {
    case iq_key(5, 15):
      return uptime(now);
    case iq_key(50, 0):
      return drive_mode();
    case iq_key(50, 8):
      return stage_.mode == PowerStage::Mode::drive ? stage_.duty : 0;
    case iq_key(50, 9):
      return control_.volts();
    case iq_key(50, 10):
      return r.speed * memory_.finite(50, 18);
    case iq_key(50, 41):
      return std::lround(control_.derate() * kFix16);
    case iq_key(50, 45):
      return r.emf + limits_.amps_max * limits_.resistance;
    case iq_key(69, 2):
      return r.amps * r.volts;
    case iq_key(73, 5):
      return derate_between(memory_.value(73, 3), memory_.value(73, 4), r.controller_celsius);
    case iq_key(77, 5):
      return std::lround(kFix16 * derate_between(memory_.value(77, 1), memory_.value(77, 2), r.coil_celsius));
    case iq_key(83, 10):
      return derate_between(memory_.value(83, 8), memory_.value(83, 9), r.coil_celsius);
    case iq_key(84, 0):
      return safety_.now();
    case iq_key(84, 1):
      return safety_.ever();
    case iq_key(86, 12):
      return armed_ ? 1 : 0;
    default:
      return std::nullopt;
  }
}

double IqDevice::line_rate() const noexcept { return baud_ * (1 + settings_.oscillator_gain); }

double IqDevice::uptime(Instant now) const noexcept {
  return to_seconds(now - booted_) * (1 + settings_.oscillator_gain) + time_offset_;
}

}  // namespace kphi::sim
