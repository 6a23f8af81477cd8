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

/// By two entries of a client: where the derate starts, and then where it ends.
double derate(const IqMemory& memory, std::uint8_t client, std::uint8_t start, double celsius) noexcept {
  const auto end = static_cast<std::uint8_t>(start + 1);
  return derate_between(memory.value(client, start), memory.value(client, end), celsius);
}

}  // namespace

IqDevice::IqDevice(const IqSettings& settings, const MotorState& state)
    : settings_(settings),
      state_(&state),
      memory_(settings.quirks),
      scanner_(kReceiveBuffer),
      sensors_(settings.sensors, settings.oscillator_gain, settings.seed),
      random_(~settings.seed) {
  memory_.provide(5, 14, settings.module_id);
  memory_.provide(16, 0, settings.baud);
  memory_.provide(52, 15, settings.timeout_s);
  replace(settings.uid);
  boot(settings.begin);
}

void IqDevice::receive(std::span<const std::uint8_t> bytes, Instant now) {
  heard_ = std::max(heard_, now);
  if (now < off_until_) return;
  attend(now);
  while (!bytes.empty()) {
    const std::size_t taken = scanner_.feed(bytes);
    if (taken == 0) return;
    bytes = bytes.subspan(taken);
    attend(now);
    if (now < off_until_) return;
  }
}

void IqDevice::advance(Instant now) noexcept {
  heard_ = std::max(heard_, now);
  if (now < off_until_) {
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
  if (++ticks_ % kTicksPerSafety == 0) {
    const IqReadings readings = sensors_.readings(*state_);
    if (!settings_.quirks.no_power_safety && safety_.check(memory_, readings) && memory_.value(84, 2) != 0)
      rest(MotorDrive::Mode::coast);
    const double coil = settings_.quirks.legacy ? derate(memory_, 77, 1, readings.coil_celsius)
                                                : derate(memory_, 83, 8, readings.coil_celsius);
    limits_.thermal = coil * derate(memory_, 73, 3, readings.controller_celsius);
  }
  const IqSensed sensed{state_->speed / (1 + settings_.oscillator_gain), state_->supply_volts};
  stage_ = control_.step(safety_.safe_mode() ? MotorDrive{} : drive_, limits_, sensed);
}

bool IqDevice::next_reply(IqReply& out, Instant now) {
  if (now >= off_until_) attend(now);
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
    if (now < off_until_) return;
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
  IqReply reply;
  if (const auto value = live_value(iq_key(type, sub), sensors_.readings(*state_), now)) {
    bits = iq_bits(cell->entry.format, *value);
    reply.truth = live_value(iq_key(type, sub), sensors_.perfect(*state_), now).value_or(reply.truth);
  }
  const bool on_zero = settings_.quirks.system_control_on_id_zero && type == kSystemControl;
  reply.asked = now;
  const double jitter = 0.5 * (random_.symmetric() + 1) * to_seconds(settings_.reply_jitter);
  reply.at = now + from_seconds((to_seconds(settings_.reply_latency) + jitter) * settings_.time_scale);
  reply.type = type;
  reply.sub = sub;
  reply.id = on_zero ? 0 : static_cast<std::uint8_t>(memory_.value(5, 14));
  reply.size = static_cast<std::uint8_t>(iq_size(cell->entry.format));
  put_little(reply.bytes.data(), bits, reply.size);
  busy_until_ = reply.at;
  replies_.push_back(reply);
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
  const auto is = [key](std::uint8_t type, std::uint8_t sub) { return key == iq_key(type, sub); };
  const auto fix16 = [](double share) { return std::lround(share * kFix16); };
  if (is(5, 15)) return to_seconds(now - booted_) * (1 + settings_.oscillator_gain);
  if (is(50, 0)) return drive_mode();
  if (is(50, 8)) return stage_.mode == PowerStage::Mode::drive ? stage_.duty : 0;
  if (is(50, 9)) return control_.volts();
  if (is(50, 11) || is(69, 0)) return r.volts;
  if (is(50, 12)) return r.angle;
  if (is(50, 13)) return r.speed;
  if (is(50, 36)) return r.motor_amps;
  if (is(50, 41)) return fix16(control_.derate());
  if (is(69, 1)) return r.amps;
  if (is(69, 2)) return r.amps * r.volts;
  if (is(69, 3)) return r.joules;
  if (is(73, 0)) return r.controller_celsius;
  if (is(73, 5)) return derate(memory_, 73, 3, r.controller_celsius);
  if (is(77, 0) || is(83, 0)) return r.coil_celsius;
  if (is(83, 1)) return r.stator_celsius;
  if (is(77, 5)) return fix16(derate(memory_, 77, 1, r.coil_celsius));
  if (is(83, 10)) return derate(memory_, 83, 8, r.coil_celsius);
  if (is(84, 0)) return safety_.now();
  if (is(84, 1)) return safety_.ever();
  return std::nullopt;
}

}  // namespace kphi::sim
