// What the compensation costs, in ratios of one run: against the map it replaces, four plain sqrt(T/K_T), and against
// its own formula written straight down, both compiled as the library is. Interleaved; median of many pairs, and the
// worst.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "compensation/mixing.hpp"
#include "test/bench/figures.hpp"
#include "test/compensation/example_vehicle.hpp"
#include "test/compensation/line_of.hpp"

namespace {

using namespace kphi;
using namespace kphi::compensation;

constexpr int kCalls = 4000, kPairs = 101;

/// Keeps the compiler from leaving out what reads or fills `config`.
void use(const void* config) { asm volatile("" : : "r"(config) : "memory"); }

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

template <class Work>
double ns_per_call(Work& work) {
  const double begun = cpu_seconds();
  for (int i = 0; i < kCalls; ++i) work(i);
  return (cpu_seconds() - begun) * 1e9 / kCalls;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// One line: what it costs, what its peer costs, the ratio and its goal.
template <class Work, class Peer>
void compare(const char* what, Work work, Peer peer, double goal) {
  std::vector<double> ratios, ours, theirs;
  for (int pair = 0; pair < kPairs; ++pair) {
    ours.push_back(ns_per_call(work));
    theirs.push_back(ns_per_call(peer));
    ratios.push_back(ours.back() / theirs.back());
  }
  const double ratio = median(ratios), worst = *std::max_element(ratios.begin(), ratios.end());
  std::printf("%-44s %7.1f ns, peer %7.1f ns, worst of %d pairs %5.2f\n", what, median(ours), median(theirs), kPairs,
              worst);
  goal > 0 ? bench::at_most(goal, ratio, what) : bench::compared(ratio, what);
}

/// Not inlined: the peers are calls across a library boundary, as the library's own are.
[[gnu::noinline]] std::array<RadPerSec, 4> plain_speeds(const Rotors<Newtons>& thrusts, ThrustCoefficient k) {
  std::array<RadPerSec, 4> speeds;
  for (std::size_t i = 0; i < 4; ++i) speeds[i] = RadPerSec(std::sqrt(thrusts[i].value() / k.value()));
  return speeds;
}

struct Update {
  std::array<double, 4> phi, factor, thrust_max, drag_scale;
};

double shared(double from, double to, double other_from, double other_to) {
  return std::max(0.0, std::min(to, other_to) - std::max(from, other_from));
}

/// The closed form of the rim arc and what follows from it, for every arm at every call, without a shortcut.
[[gnu::noinline]] Update straightforward(const Airframe& frame, const ThrustCurve& line,
                                         const std::array<Radians, 4>& arms) {
  Update update{};
  const double a = frame.half_side.value(), arm = frame.arm_length.value(), r = frame.propeller_radius.value();
  const auto held = [](double c) { return std::min(std::max(c, -1.0), 1.0); };
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = a + arm * std::cos(arms[i].value()), y = a + arm * std::sin(arms[i].value());
    const double a1 = std::acos(held((a - x) / r)), a2 = std::acos(held((-a - x) / r));
    const double b1 = std::asin(held((-a - y) / r)), b2 = std::asin(held((a - y) / r));
    update.phi[i] = shared(a1, a2, b1, b2) + shared(-a2, -a1, b1, b2) + shared(a1, a2, kPi - b2, kPi - b1) +
                    shared(2 * kPi - a2, 2 * kPi - a1, kPi - b2, kPi - b1);
    const double k = line_of(line).intercept.value() + line_of(line).slope_per_rad * update.phi[i];
    update.factor[i] =
        update.phi[i] > 0 ? std::min(std::max(k / line.thrust_coefficient().value(), kScalingFloor), 1.0) : 1.0;
    const double fastest = frame.fastest_speed.value();
    update.thrust_max[i] = line.thrust_coefficient().value() * update.factor[i] * fastest * fastest;
    update.drag_scale[i] = 1 / update.factor[i];
  }
  return update;
}

std::array<Radians, 4> moved(std::array<Radians, 4> arms, double by_deg) {
  for (Radians& angle : arms) angle = angle - from_degrees(by_deg);
  return arms;
}

void compare_set_arms(const char* what, const std::array<Radians, 4>& arms, double move_deg, double goal) {
  // Two sets of angles in turn, so that every arm has moved at every call.
  const std::array<std::array<Radians, 4>, 2> both = {arms, moved(arms, move_deg)};
  Compensator compensator = example_compensator();
  const Airframe frame = example_airframe();
  const ThrustCurve line = paper_line();
  compare(
      what,
      [&](int i) {
        compensator.set_arms(both[i & 1]);
        use(&compensator);
      },
      [&](int i) {
        use(&both);
        const Update update = straightforward(frame, line, both[i & 1]);
        use(&update);
      },
      goal);
}

void compare_mixing() {
  const Mixer mixer = *Mixer::build(example_layout(shape_o()), {Metres(0.0133), 0.0});
  const ThrustLimits limits{{}, thrusts_of(5.2, 5.2, 5.6, 5.2)};
  const auto mix = [&](const Wrench& demand) {
    return [&mixer, &limits, demand](int) {
      use(&demand);
      const MixedThrusts mixed = mixer.mix(demand, limits);
      use(&mixed);
    };
  };
  const Wrench within{Newtons(6), NewtonMetres(0.02), NewtonMetres(-0.03), NewtonMetres(0.005)};
  const Wrench beyond{Newtons(20), NewtonMetres(0.2), NewtonMetres(-0.1), NewtonMetres(0.05)};
  compare("mix, saturated / within the limits", mix(beyond), mix(within), 0);
}

}  // namespace

int main() {
  Rotors<Newtons> thrusts = thrusts_of(1.4, 1.5, 1.6, 1.7);  // as the mixer gives them
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
  compare(
      "speeds_for / plain map of four rotors",
      [&](int) {
        use(&thrusts);
        const SpeedCommand command = compensator.speeds_for(thrusts);
        use(&command);
      },
      [&](int) {
        use(&thrusts);
        const auto speeds = plain_speeds(thrusts, kExampleCoefficient);
        use(&speeds);
      },
      1.5);
  compare_set_arms("set_arms in X / straightforward formula", shape_x(), 0.1, 0.2);
  compare_set_arms("set_arms in O / straightforward formula", shape_o(), 0.1, 1.2);
  compare_set_arms("set_arms, arms at rest / straightforward", shape_o(), 0.0, 0);
  compare_mixing();
}
