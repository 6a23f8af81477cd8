// What the dearest call of the flying library takes beside the median one: single calls, each timed by itself, on one
// core. The raw tail is the operating system's: the same piece of work, timed in the same way, shows it.
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <vector>

#include "compensation/mixing.hpp"
#include "test/bench/figures.hpp"
#include "test/bench/latency.hpp"
#include "test/compensation/example_vehicle.hpp"

namespace {

using namespace kphi;
using namespace kphi::bench;
using namespace kphi::compensation;

constexpr std::size_t kInputs = 2000, kRounds = 301;
constexpr int kBatch = 32;

/// Keeps the compiler from leaving out what reads or fills `config`.
void use(const void* config) { asm volatile("" : : "r"(config) : "memory"); }

void tell(const char* what, const Latencies& l) {
  std::printf(
      "%-40s median %6.0f, dearest input %6.0f; raw 99.9 %% %6.0f, 99.99 %% %6.0f, longest %8.0f; %ld context "
      "switches in %.2g calls\n",
      what, l.usual, l.dearest, l.p999, l.p9999, l.longest, l.switches, static_cast<double>(l.calls));
}

template <class Four>
std::vector<std::array<Four, 4>> drawn(std::size_t count, double low, double high) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> value(low, high);
  std::vector<std::array<Four, 4>> result(count);
  for (auto& four : result) {
    for (Four& one : four) one = Four(value(random));
  }
  return result;
}

/// Those of a flight, a quarter of them with one or four that are odd or beyond the limits.
std::vector<std::array<Newtons, 4>> any_thrusts() {
  auto thrusts = drawn<Newtons>(kInputs, 0.5, 3);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double odd[] = {0.0, std::numeric_limits<double>::quiet_NaN(), kInfinity, 1e-300, -1, 9};
  for (std::size_t i = 0; i < kInputs; i += 4) {
    const Newtons one(odd[i / 4 % std::size(odd)]);
    thrusts[i][i / 24 % 4] = one;
    if (i % 8 == 0) thrusts[i].fill(one);
  }
  return thrusts;
}

/// Four rotors of the map that the library replaces, always with the same thrusts: what the machine adds to any call.
void tell_of_fixed_work(double clock) {
  const auto thrusts = thrusts_of(1.4, 1.5, 1.6, 1.7);
  tell("the same four roots every time", latencies(kInputs, kRounds, clock, [&](std::size_t) {
         use(&thrusts);
         std::array<double, 4> speeds;
         for (std::size_t i = 0; i < 4; ++i) speeds[i] = std::sqrt(thrusts[i].value() / kExampleCoefficient.value());
         use(&speeds);
       }));
}

void speeds(double clock) {
  const auto thrusts = any_thrusts();
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
  const auto call = [&](std::size_t input) {
    use(&thrusts);
    const SpeedCommand command = compensator.speeds_for(thrusts[input]);
    use(&command);
  };
  const Latencies single = latencies(kInputs, kRounds, clock, call);
  tell("speeds_for, any thrust, NaN, limits", single);
  const Latencies batch = latencies(kInputs, kRounds, clock, [&](std::size_t input) {
    for (int i = 0; i < kBatch; ++i) call(input);
  });
  tell("32 times the same", batch);
  if (clock > single.usual) std::printf("the clock alone takes longer (%.0f): the batches count, too\n", clock);
  at_most(2.5, single.worst_over_median(), "speeds_for: dearest of 2000 inputs over the median call, single calls");
  at_most(2.5, batch.worst_over_median(), "speeds_for: the same, in batches of 32");
}

Latencies arms(const char* what, double clock, const Compensator& built, double from_deg, double to_deg) {
  const auto angles = drawn<Radians>(kInputs, from_degrees(from_deg).value(), from_degrees(to_deg).value());
  Compensator compensator = built;
  const Latencies found = latencies(kInputs, kRounds, clock, [&](std::size_t input) {
    compensator.set_arms(angles[input]);
    use(&compensator);
  });
  tell(what, found);
  return found;
}

Compensator by_measure(OverlapMeasure measure) { return compensator_of(example_airframe(measure)); }

void set_arms(double clock) {
  const Latencies rim = arms("set_arms, four overlaps, rim", clock, example_compensator(), 147.5, 180);
  const Latencies area =
      arms("set_arms, four overlaps, area", clock, by_measure(OverlapMeasure::area_share), 147.5, 180);
  const Latencies load =
      arms("set_arms, four overlaps, load", clock, by_measure(OverlapMeasure::load_share), 147.5, 180);
  const Latencies any = arms("set_arms, any angle", clock, example_compensator(), -90, 180);
  at_most(2.5, rim.worst_over_median(), "set_arms, four overlaps by rim arc: dearest input over the median call");
  at_most(2.5, area.worst_over_median(), "set_arms, four overlaps by area: the same");
  at_most(2.5, load.worst_over_median(), "set_arms, four overlaps by load: the same");
  at_most(2.5, any.dearest / rim.usual, "set_arms, any angle: dearest input over the median call of four overlaps");
  compared(any.worst_over_median(),
           "set_arms, any angle: over its own median (arms out of reach cost next to nothing)");
}

void mixing(double clock) {
  const Mixer mixer = *Mixer::build(example_layout(shape_o()), {Metres(0.0133), 0.0});
  const ThrustLimits limits{{}, thrusts_of(5.2, 5.2, 5.6, 5.2)};
  const auto demands = drawn<Newtons>(kInputs, -1, 1);
  const Latencies found = latencies(kInputs, kRounds, clock, [&](std::size_t input) {
    const auto& d = demands[input];
    const MixedThrusts mixed = mixer.mix({Newtons(10 + 10 * d[0].value()), NewtonMetres(0.3 * d[1].value()),
                                          NewtonMetres(0.3 * d[2].value()), NewtonMetres(0.1 * d[3].value())},
                                         limits);
    use(&mixed);
  });
  tell("mix, mostly beyond the limits", found);
  compared(found.worst_over_median(), "mix, mostly beyond the limits: dearest input over the median call");
}

}  // namespace

int main() {
  stay_on_this_core();
  const double clock = ticks_of_the_clock();
  std::printf("in %s, less the %.0f that timing nothing takes:\n", kTick, clock);
  tell_of_fixed_work(clock);
  speeds(clock);
  set_arms(clock);
  mixing(clock);
}
