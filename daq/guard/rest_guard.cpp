#include "daq/guard/rest_guard.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "daq/guard/run_stopped.hpp"
#include "drivers/iq/wire/codes.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kTickWall = std::chrono::milliseconds(10);
constexpr Duration kUnseenWall = std::chrono::seconds(3);  // a module that answers is read fifty times per second

}  // namespace

SafetyStop still_turning(RadPerSec speed) {
  return SafetyStop(fmt::format("motor: coasting but still turning at {:.0f} RPM after {:.0f} s", to_rpm(speed),
                                kSpinDownLimitSeconds),
                    kKeepAway);
}

RestGuard::RestGuard(Bench& bench, bool motor_has_power)
    : bench_(bench),
      motor_has_power_(motor_has_power),
      begun_(bench.clock().now()),
      speed_at_ns_(begun_.count() - 1),
      polling_(bench.run_periodically({"guard at rest", true}, [this] { poll(); })) {}

void RestGuard::await_rest(const std::function<bool()>& stop_asked) {
  if (!motor_has_power_) return;
  const Clock& clock = bench_.clock();
  const Instant from = clock.now();
  const Instant unseen = from + clock.stretched(kUnseenWall), give_up = from + from_seconds(kSpinDownLimitSeconds);
  for (;;) {
    bench_.wait_until(clock.now() + clock.stretched(kTickWall));
    check();
    if (stop_asked()) throw Interrupted("stopped by request");
    const bool seen = speed_at_ns_ >= from.count();
    if (seen && speed_rad_s_ < kStandstill.value()) break;
    if (!seen && clock.now() > unseen) throw SafetyStop("motor: no speed reading; it may be turning", kKeepAway);
    if (clock.now() > give_up) throw still_turning(RadPerSec(speed_rad_s_));
  }
  resting_ = true;
}

void RestGuard::poll() noexcept {
  try {
    if (has_slept(bench_.clock())) trip(slept(bench_.clock()));
    if (std::string why = bench_.unprotected(); !why.empty()) trip({std::move(why), Source::computer});
    take_readings();
    take_supply();
  } catch (...) {
    bench_.motor().emergency_stop();
    trip({"the guard failed"});
  }
}

void RestGuard::take_readings() {
  (void)bench_.motor().take_events();  // of a closed link, or of a module whose power a person has cut
  std::array<MotorReading, 64> readings;
  while (const std::size_t n = bench_.motor().take(readings))
    for (std::size_t i = 0; i < n; ++i) judge(readings[i]);
}

void RestGuard::judge(const MotorReading& reading) {
  if (Instant(reading.time_ns) < begun_) return;
  if (reading.channel == MotorChannel::speed) {
    speed_rad_s_ = std::abs(reading.value);
    speed_at_ns_ = reading.time_ns;
    // Written so that NaN trips.
    if (resting_ && !(speed_rad_s_ < kStandstill.value()))
      trip({fmt::format("motor: turning at {:.0f} RPM while somebody may be near", to_rpm(RadPerSec(speed_rad_s_))),
            Source::motor});
  }
  if (resting_ && reading.channel == MotorChannel::drive_mode &&
      reading.value != static_cast<double>(iq::DriveMode::coast))
    trip({"motor: its module does not coast while somebody may be near", Source::motor});
}

void RestGuard::take_supply() {
  if (bench_.supply() == nullptr) return;
  std::array<SupplyReading, 16> readings;
  while (const std::size_t n = bench_.supply()->take(readings)) {
    for (std::size_t i = 0; i < n; ++i) {
      const bool late = Instant(readings[i].time_ns) >= begun_;
      if (!motor_has_power_ && late && readings[i].output != 0)
        trip({"supply: output is on while somebody may be near", Source::supply});
    }
  }
}

void RestGuard::trip(Trip found) noexcept {
  found.noticed = bench_.clock().now();
  if (!latch_.set(std::move(found))) return;
  bench_.motor().emergency_stop();
  if (bench_.supply() != nullptr) bench_.supply()->cut();
}

}  // namespace kphi::daq
