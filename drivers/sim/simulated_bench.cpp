#include "drivers/sim/simulated_bench.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace kphi::sim {
namespace {

constexpr double kSafeToTouch = 5.0;  // rad/s
// Faults draw from another sequence than the physics, which therefore stays the same with and without them.
constexpr std::uint64_t kWireStream = 0x5bd1e995'6c62272eull;
constexpr std::uint64_t kLineStream = 0x9e3779b9'7f4a7c15ull;
constexpr std::uint64_t kModuleStream = 0x2545f491'4f6cdd1dull;

IqSettings module_of(const BenchSettings& settings) {
  IqSettings module = settings.module;
  module.oscillator_gain = settings.oscillator_gain;
  module.time_scale = settings.time_scale;
  module.seed = settings.seed ^ kModuleStream;
  module.begin = settings.begin;
  return module;
}

/// Exact in integers: no drift of the ticks against the clock.
constexpr Instant time_of_tick(std::uint64_t tick) noexcept {
  return Instant(static_cast<std::int64_t>(tick * 1'000'000 / 7));
}
static_assert(kTicksPerSecond == 7000);

}  // namespace

SimulatedBench::SimulatedBench(const BenchSettings& settings)
    : plant_(settings.plant, settings.seed),
      netbox_(settings.netbox),
      wire_(netbox_, settings.faults, settings.seed ^ kWireStream, settings.keep),
      motor_(module_of(settings), plant_.motor()),
      motor_line_(motor_, {settings.motor_line_paced, settings.time_scale, settings.motor_usb_tick}, settings.faults,
                  settings.seed ^ kLineStream, settings.motor_keep),
      ticks_(static_cast<std::uint64_t>(settings.begin.count()) / 1'000'000 * 7),
      tick_at_(time_of_tick(ticks_)) {
  if (!settings.supply) return;
  SupplySettings supply = *settings.supply;
  supply.faults = settings.faults;
  supply_.emplace(supply);
  plant_.power([this](double amps, double siemens) { return supply_->advance({amps, siemens}, tick_at_); });
}

void SimulatedBench::mount(const std::string& propeller_id, double occlusion_deg) {
  const PropellerTruth* propeller = find_propeller(propeller_id);
  if (propeller == nullptr) {
    throw std::invalid_argument("unknown propeller \"" + propeller_id + "\"; known: 5x2, 5x3, 6x2, 6x3");
  }
  if (!(occlusion_deg >= 0 && occlusion_deg < 360)) {
    throw std::invalid_argument(fmt::format("occlusion {}° is outside 0° to below 360°", occlusion_deg));
  }
  const double speed = plant_.motor().speed;
  if (std::abs(speed) > kSafeToTouch) {
    throw std::invalid_argument(
        fmt::format("the motor is turning at {:.0f} rad/s; coast it and wait for standstill", speed));
  }
  plant_.mount(propeller, occlusion_deg);
  mounted_ = fmt::format("{} {}", propeller_id, occlusion_deg);
}

void SimulatedBench::hang(int axis, double newtons) {
  if (axis < 0 || axis > 2) throw std::invalid_argument("a weight pulls along x, y or z");
  if (!(std::abs(newtons) <= 1e4)) throw std::invalid_argument("a weight is within ±10 kN");
  plant_.hang(static_cast<std::size_t>(axis), newtons);
}

void SimulatedBench::advance(Instant now) {
  for (Instant at = time_of_tick(ticks_ + 1); at <= now; at = time_of_tick(ticks_ + 1)) {
    ++ticks_;
    tick_at_ = at;
    if (at >= motor_line_.next_event()) motor_line_.advance(at);
    plant_.upset(motor_line_.upset());
    motor_.advance(at);
    plant_.step(motor_.stage());
    wire_.sample({at, plant_.reading()});
  }
  motor_line_.advance(now);
}

}  // namespace kphi::sim
