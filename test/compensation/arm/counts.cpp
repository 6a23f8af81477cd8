// How many instructions the calls of the library take on this processor: "name count" a line. Under qemu with
// `-icount shift=0` an instruction takes one nanosecond of the board's time, which SysTick counts.
#include <cstdint>

#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"

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

template <class Call>
std::uint32_t ticks_of(const Call& call) {
  value = 0;
  const std::uint32_t before = value;
  for (int i = 0; i < kRepetitions; ++i) call(i);
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
  print(name);
  print(" ");
  print_number((taken - empty) * kNanosecondsPerTick / kRepetitions);
  print("\n");
}

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
  return 0;
}
