#include "examples/second_bench/esc_motor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.hpp"
#include "base/thread.hpp"
#include "daq/bench/device_records.hpp"
#include "daq/bench/offered_drivers.hpp"
#include "drivers/iq/wire/codes.hpp"

namespace kphi::second_bench {
namespace {

constexpr Duration kLease = std::chrono::milliseconds(500);  // wall time
constexpr Duration kEvery = std::chrono::milliseconds(10);
constexpr Duration kConnects = std::chrono::seconds(2);
constexpr Duration kBoardSilent = std::chrono::milliseconds(200);  // the board coasts after 250
constexpr std::size_t kMostReadings = 100'000;
enum Count : std::size_t { requests = 0, replies = 1, bad = 5 };  // of kMotorCounts

SpeedLoop::Settings settings_of(const profiles::BenchConfig& bench) {
  daq::DeviceSettings given(*bench.motor);
  const SpeedLoop::Settings settings{given.number("pole_pairs", 1, 50),
                                     from_rpm(given.number("kv_rpm_per_v", 10, 20'000)).value(),
                                     given.number("proportional", 0, 100, 0.5), given.number("integral", 0, 1000, 4)};
  given.finish();
  return settings;
}

}  // namespace

EscMotor::EscMotor(const profiles::BenchConfig& bench, const Clock& clock)
    : clock_(clock),
      spin_(bench.iq.spin),
      loop_(settings_of(bench)),
      port_(bench.motor->device, bench.motor->baud),
      heard_(clock.now()),
      thread_(start_thread({"motor", true}, [this] { serve(); })) {
  for (const Instant give_up = clock.now() + kConnects; !stands_by() && clock.now() < give_up;)
    std::this_thread::sleep_for(kEvery);
  if (stands_by()) return;
  quit();
  throw DeviceError("ESC " + port_.device(), "connect", "its board did not say within 2 s that the motor coasts");
}

EscMotor::~EscMotor() { quit(); }

void EscMotor::quit() noexcept {
  emergency_stop();
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  if (thread_.joinable()) thread_.join();
}

bool EscMotor::stands_by() const {
  const std::lock_guard lock(mutex_);
  return applied_ == 0;
}

void EscMotor::serve() {
  for (;;) {
    try {
      if (port_.wait(std::chrono::milliseconds(2))) hear();
    } catch (const DeviceError& gone) {
      const std::lock_guard lock(mutex_);
      lost_ = gone.what();
      return;
    }
    const std::lock_guard lock(mutex_);
    if (quit_) return;
    order(clock_.now());
  }
}

void EscMotor::hear() {
  std::array<std::uint8_t, 512> bytes{};
  lines_.take({reinterpret_cast<const char*>(bytes.data()), port_.read(bytes)});
  const Instant at = clock_.now();
  while (const auto line = lines_.next('R', 5)) {
    const std::lock_guard lock(mutex_);
    take(*line, at);
  }
}

void EscMotor::take(const std::vector<std::int64_t>& line, Instant at) {
  ++counts_[replies];
  counts_[bad] = lines_.malformed();
  const double seconds = to_seconds(at - std::exchange(heard_, at));
  applied_ = static_cast<int>(line[0]);
  speed_ = from_rpm(static_cast<double>(line[1]) / loop_.settings().pole_pairs).value();
  volts_ = 0.01 * static_cast<double>(line[2]);
  if (readings_.size() > kMostReadings) readings_.clear();
  const auto add = [&](MotorChannel channel, double value) {
    readings_.push_back({channel, at.count(), kEvery.count() / 2, value});
  };
  add(MotorChannel::speed, spin_ * speed_);
  add(MotorChannel::supply_voltage, volts_);
  add(MotorChannel::supply_current, 0.01 * static_cast<double>(line[3]));
  add(MotorChannel::drive_pwm, spin_ * applied_ / SpeedLoop::kMost);
  add(MotorChannel::drive_mode, static_cast<double>(applied_ == 0 ? iq::DriveMode::coast : iq::DriveMode::spin_pwm));
  drives_ = wanted_ > 0 && (drives_ || applied_ > 0);
  if (drives_ && applied_ == 0) give_up(at, EventKind::motor_let_go, "its board let it go by itself");
  if (wanted_ > 0) throttle_ = loop_.throttle(wanted_, speed_, volts_, std::min(seconds, 0.1));
  if (!stopping_.active()) return;
  if (throttle_ == 0 && applied_ == 0) stopping_.confirmed(at);
  stopping_.measured(speed_, at);
  stopping_.advance(at);
}

/// The next line to the board, and everything that must coast the motor.
void EscMotor::order(Instant now) {
  // Also while this computer slept: the board has coasted the motor by then, and an order would turn it again.
  const Duration here = clock_.shrunk(now) + clock_.suspended();
  if (here - std::exchange(served_, here) > kBoardSilent)
    give_up(now, EventKind::motor_host_absent, "this computer did not run the driver, and its board coasted it");
  if (clock_.shrunk(now - renewed_) > kLease && !stopping_.active())
    give_up(now, EventKind::motor_lease_expired, "kphi did not renew its command in time, so the driver coasted it");
  if (const auto speed = stopping_.ramp(now)) {
    wanted_ = std::abs(*speed);
    if (wanted_ == 0) coast(now);
  }
  stopping_.advance(now);
  if (now < next_order_) return;
  next_order_ = now + clock_.stretched(kEvery);
  send(throttle_);
}

/// It does not turn again: whoever ordered the speed knows nothing of the pause.
void EscMotor::give_up(Instant now, EventKind kind, const char* why) {
  if (wanted_ == 0) return;
  coast(now);
  lost_ = why;
  events_.push_back(daq::event_at(now, kind, why));
}

void EscMotor::send(int throttle) noexcept {
  const std::string line = checked(fmt::format("T,{}", throttle));
  try {
    (void)port_.write({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()});
    ++counts_[requests];
  } catch (const std::exception& gone) {
    lost_ = gone.what();
  }
}

void EscMotor::coast(Instant now) noexcept {
  wanted_ = throttle_ = 0;
  loop_.reset();
  send(0);
  if (stopping_.active()) stopping_.coasted(now);
}

void EscMotor::spin_at(RadPerSec signed_speed) {
  const std::lock_guard lock(mutex_);
  if (!lost_.empty()) throw DeviceError("ESC " + port_.device(), "spin", lost_);
  if (stopping_.active()) stopping_.end(iq::StopReport::Outcome::overruled);
  renewed_ = clock_.now();
  wanted_ = std::abs(signed_speed.value());
  if (wanted_ == 0) return coast(renewed_);
  if (throttle_ == 0) throttle_ = static_cast<int>(SpeedLoop::kLeast);
}

void EscMotor::renew() noexcept {
  const std::lock_guard lock(mutex_);
  renewed_ = clock_.now();
}

void EscMotor::emergency_stop() noexcept {
  const std::lock_guard lock(mutex_);
  for (int i = 0; i < 3; ++i) coast(clock_.now());
}

void EscMotor::begin_stop(const iq::StopSettings& settings) {
  const std::lock_guard lock(mutex_);
  if (stopping_.active()) return;
  iq::Stopping::check(settings);
  const Instant now = clock_.now();
  stopping_.begin(settings, speed_, settings.deceleration.has_value(), now);
  if (!settings.deceleration) coast(now);
}

std::optional<iq::StopReport> EscMotor::stop_report() {
  const std::lock_guard lock(mutex_);
  return stopping_.active() ? std::nullopt : stopping_.report();
}

std::size_t EscMotor::take(std::span<MotorReading> out) {
  const std::lock_guard lock(mutex_);
  return daq::move_oldest(readings_, out);
}

std::vector<StreamEvent> EscMotor::take_events() {
  const std::lock_guard lock(mutex_);
  return std::exchange(events_, {});
}

std::string EscMotor::failure() const {
  const std::lock_guard lock(mutex_);
  if (!lost_.empty()) return "motor: " + lost_;
  const bool silent = wanted_ > 0 && clock_.shrunk(clock_.now() - heard_) > kBoardSilent;
  return silent ? "motor: the ESC's board said nothing for 0.2 s" : "";
}

results::MotorCounts EscMotor::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace kphi::second_bench
