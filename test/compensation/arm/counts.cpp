// How many instructions the calls of the library take on this processor, and how much stack and memory: "name number" a
// line. Under qemu with `-icount shift=0` an instruction takes one nanosecond of the board's time, which SysTick
// counts.
#include <cmath>
#include <cstdint>

#include "compensation/compensator.hpp"
#include "compensation/kphi_compensation.h"
#include "compensation/mixing.hpp"
#include "compensation/thrust_factor.hpp"
#include "test/compensation/arm/demands.hpp"

extern "C" void print(const char* text);

namespace {

using namespace kphi;
using namespace kphi::compensation;

volatile std::uint32_t& control = *reinterpret_cast<volatile std::uint32_t*>(0xE000E010);
volatile std::uint32_t& reload = *reinterpret_cast<volatile std::uint32_t*>(0xE000E014);
volatile std::uint32_t& value = *reinterpret_cast<volatile std::uint32_t*>(0xE000E018);
constexpr std::uint32_t kNanosecondsPerTick = 40;  // both boards run at 25 MHz
constexpr int kRepetitions = 500;

void print_number(unsigned number) {
  char text[12];
  char* at = text + sizeof text;
  *--at = 0;
  do *--at = static_cast<char>('0' + number % 10);
  while ((number /= 10) != 0);
  print(at);
}

void tell(const char* name, unsigned number) {
  print(name);
  print(" ");
  print_number(number);
  print("\n");
}

template <class Call>
std::uint32_t ticks_of(const Call& call, int repetitions = kRepetitions) {
  value = 0;
  const std::uint32_t before = value;
  for (int i = 0; i < repetitions; ++i) call(i);
  return (before - value) & 0xFFFFFFu;
}

volatile Real sink;

template <class Call>
void count(const char* name, const Call& call) {
  const std::uint32_t empty = ticks_of([](int) { __asm__ volatile("" ::: "memory"); });
  const std::uint32_t taken = ticks_of([&](int i) {
    __asm__ volatile("" ::: "memory");
    call(i);
  });
  tell(name, (taken - empty) * kNanosecondsPerTick / kRepetitions);
}

#if DEMANDS > 0
/// The longest of DEMANDS demands on random vehicles that must be searched for.
void count_searches(const char* name, bool curved) {
  test::Demands demands(12345);
  std::uint32_t longest = 0;
  for (int i = 0; i < DEMANDS; ++i) {
    const test::Demand one = demands.next(curved);
    auto mixer = Mixer::build(one.layout, one.drag);
    if (!mixer || !mixer->set_layout(one.layout, one.drag_scale)) continue;
    const std::uint32_t taken =
        ticks_of([&](int) { sink = mixer->mix(one.wrench, one.limits, one.assured_yaw).achieved.yaw.value(); }, 1);
    longest = taken > longest ? taken : longest;
  }
  tell(name, longest * kNanosecondsPerTick);
}

/// The stack below a call is painted, and how deep the paint is gone is what the call takes.
template <class Call>
[[gnu::noinline]] void measure_stack(const char* name, const Call& call) {
  constexpr int kDeep = 4096;
  constexpr std::uint32_t kPaint = 0xA5A5A5A5u;
  char* top;
  __asm__ volatile("mov %0, sp" : "=r"(top));
  auto* const paint = reinterpret_cast<volatile std::uint32_t*>(top) - 4;
  for (int i = 1; i < kDeep; ++i) paint[-i] = kPaint;
  call();
  int deepest = kDeep - 1;
  while (deepest > 0 && paint[-deepest] == kPaint) --deepest;
  tell(name, static_cast<unsigned>(4 * (deepest + 4)));
}

/// Of the dearest vehicle: eight rotors with full tables on a body of twelve corners.
void measure_stacks() {
  static kphi_curve curves[8];
  static kphi_airframe airframe;
  static kphi_compensator compensator;
  static kphi_mixer mixer;
  static kphi_real hubs[8][2], arms[8], smallest[8], largest[8], scale[8], got[8], achieved[4];
  static int spins[8];
  static unsigned short flags[8];
  constexpr kphi_real kWrench[4] = {20, 3, -3, 1};
  airframe.half_side = kphi_real(0.045);
  airframe.arm_length = kphi_real(0.117);
  airframe.propeller_radius = kphi_real(0.0635);
  airframe.fastest_speed = 2000;
  airframe.rotors = 8;
  airframe.corner_count = KPHI_MAX_CORNERS;
  for (int i = 0; i < KPHI_MAX_CORNERS; ++i) {
    const kphi_real angle = 2 * kPi * static_cast<kphi_real>(i) / 12;
    airframe.corners[i][0] = kphi_real(0.06) * std::cos(angle);
    airframe.corners[i][1] = kphi_real(0.06) * std::sin(angle);
  }
  for (int i = 0; i < 8; ++i) {
    const kphi_real angle = 2 * kPi * static_cast<kphi_real>(i) / 8;
    airframe.hinge_turn_rad[i] = angle;
    airframe.hinges[i][0] = kphi_real(0.06) * std::cos(angle);
    airframe.hinges[i][1] = kphi_real(0.06) * std::sin(angle);
    hubs[i][0] = kphi_real(0.18) * std::cos(angle);
    hubs[i][1] = kphi_real(0.17) * std::sin(angle);
    spins[i] = i % 2 == 0 ? 1 : -1;
    arms[i] = 3;
    largest[i] = 5;
    scale[i] = 1;
    kphi_curve& curve = curves[i];
    curve.largest_fitted_rad = kphi_real(4.7);
    curve.knot_count = curve.torque_count = KPHI_MAX_KNOTS;
    for (int k = 0; k < KPHI_MAX_KNOTS; ++k) {
      const kphi_real phi = kphi_real(0.4) * static_cast<kphi_real>(k);
      curve.knots[k] = {phi, kphi_real(1.5e-6) * (1 - kphi_real(0.1) * phi), 0};
      curve.torque[k] = {phi, 1, 0};
    }
    curve.trend_per_rad_s = kphi_real(1e-4);
    curve.trend_reference = 1000;
  }
  int refused = 1, flown = 0;
  measure_stack("stack_build", [&] { refused = kphi_compensator_build(&compensator, curves, &airframe, 0); });
  measure_stack("stack_set_arms", [&] { kphi_set_arms(&compensator, arms); });
  measure_stack("stack_speeds_for", [&] { kphi_speeds_for(&compensator, largest, got, flags); });
  measure_stack("stack_mixer_build",
                [&] { flown = kphi_mixer_build(&mixer, 8, hubs, spins, kphi_real(0.0133), kphi_real(1e-4)); });
  measure_stack("stack_set_layout", [&] { flown &= kphi_mixer_set_layout(&mixer, hubs, spins, scale); });
  int conceded = 0;
  measure_stack("stack_mix",
                [&] { conceded = kphi_mix(&mixer, kWrench, smallest, largest, kphi_real(0.02), got, achieved); });
  static kphi_factor factor;
  kphi_real estimated = 0, u = 0;
  flown &= kphi_factor_build(&factor, kphi_real(0.5), kphi_real(0.004), 10, kphi_real(0.03));
  measure_stack("stack_factor_update", [&] { kphi_factor_update(&factor, kphi_real(9.9), kphi_real(4.9)); });
  measure_stack("stack_factor_estimate", [&] { kphi_factor_estimate(&factor, &estimated, &u); });
  tell("stacks_are_of_what_flies", refused == 0 && flown == 1 && conceded != 0 ? 1 : 0);
  tell("bytes_compensator", sizeof(kphi_compensator));
  tell("bytes_mixer", sizeof(kphi_mixer));
}
#endif

#if DEMANDS > 0
void count_factor() {
  auto factor = *ThrustFactor::build({Real(0.5), Seconds(Real(0.004)), Seconds(10), Real(0.03)});
  for (int i = 0; i < 1000; ++i) factor.update(Real(i % 7 - 3) / 10 + Real(9.8), Newtons(Real(4.9)));
  if (!factor.estimate().known) return;
  count("factor_update", [&](int i) { factor.update(Real(9.8) + Real(i & 1), Newtons(Real(4.9))); });
  count("factor_left_out", [&](int) { factor.update(-1, Newtons(Real(4.9))); });
  count("factor_estimate", [&](int) { sink = factor.estimate().u; });
}
#endif

Rotors<Radians> all_at(Real degrees) { return Rotors<Radians>(4, from_degrees(degrees)); }

}  // namespace

int main() {
  reload = 0xFFFFFF;
  control = 5;
  count("thousand_of_nothing", [](int) { __asm__ volatile(".rept 1000\n nop\n .endr"); });
  const ThrustCoefficient k = from_newtons_per_rpm2(Real(1.7e-8));
  const auto line =
      ThrustCurve::from_line(k, k * Real(1.03), Real(-0.0028889) * k.value() * 180 / kPi, from_degrees(270));
  Airframe airframe{Metres(Real(0.045)), Metres(Real(0.117)), Metres(Real(0.0635)), RadPerSec(0), from_rpm(19100)};
  const BuildOutcome built = Compensator::build(Rotors<ThrustCurve>(4, *line), airframe);
  if (!built.compensator) return 1;
  Compensator compensator = *built.compensator;
  const Masses masses{Real(0.42), {}, Rotors<Real>(4, Real(0.045))};
  const Rotors<int> spins{1, -1, 1, -1};
  const Rotors<Radians> x[2] = {all_at(45), all_at(46)}, o[2] = {all_at(179), all_at(180)};

  count("set_arms_x", [&](int i) { compensator.set_arms(x[i & 1]); });
  count("set_arms_o", [&](int i) { compensator.set_arms(o[i & 1]); });
  const RotorLayout layout = compensator.layout(masses, spins);
  auto mixer = Mixer::build(layout, {Metres(Real(0.0133)), 0});
  if (!mixer || !mixer->set_layout(layout, compensator.drag_scale())) return 1;
  count("layout", [&](int) { sink = compensator.layout(masses, spins).hubs[3].x.value(); });
  count("set_layout", [&](int) { mixer->set_layout(layout, compensator.drag_scale()); });
  const ThrustLimits limits{{}, compensator.thrust_max()};
  const auto wrench = [](Real thrust, Real roll, Real pitch, Real yaw) {
    return Wrench{Newtons(thrust), NewtonMetres(roll), NewtonMetres(pitch), NewtonMetres(yaw)};
  };
  const Wrench usual = wrench(6, Real(0.02), Real(-0.03), Real(0.005));
  const MixedThrusts mixed = mixer->mix(usual, limits, NewtonMetres(0));
  if (mixed.concessions.any()) return 1;
  count("speeds_for", [&](int) { sink = compensator.speeds_for(mixed.thrusts).speeds[3].value(); });
  count("mix", [&](int) { sink = mixer->mix(usual, limits, NewtonMetres(0)).achieved.yaw.value(); });
  count("mix_and_speeds_for", [&](int) {
    sink = compensator.speeds_for(mixer->mix(usual, limits, NewtonMetres(0)).thrusts).speeds[3].value();
  });
  const Wrench yawing = wrench(6, 0, 0, Real(0.1)), torn = wrench(6, 9, -9, 9);
  count("mix_short_of_yaw", [&](int) { sink = mixer->mix(yawing, limits, NewtonMetres(0)).achieved.yaw.value(); });
  count("mix_short_of_all", [&](int) { sink = mixer->mix(torn, limits, NewtonMetres(0)).achieved.yaw.value(); });
#if DEMANDS > 0
  count_searches("longest_search", false);
  count_searches("longest_search_curved", true);
  measure_stacks();
  count_factor();
#endif
  return 0;
}
