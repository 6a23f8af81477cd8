// What nobody should pass, into all calls of a flight: any 32 or 64 bits as a number. It is compiled as its user
// compiles, also with -ffast-math, and so looks at the bits of what comes out. Prints how many results it saw, and how
// many of them were bad; fails if any was.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>

#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"
#include "compensation/throttle.hpp"

namespace {

using namespace kphi;
using namespace kphi::compensation;
using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;

/// NaN, infinities, the smallest and the largest, and what is usual, as bits: a compiler may know no such constants.
class Odd {
 public:
  explicit Odd(unsigned seed) : random_(seed) {}
  Real next() {
    constexpr bool kSingle = sizeof(Real) == 4;
    constexpr Bits kExponent = static_cast<Bits>(kSingle ? 0x7F800000u : 0x7FF0000000000000u),
                   kSign = Bits{1} << (8 * sizeof(Bits) - 1);
    const Bits odd[] = {kExponent | (kExponent >> 1 & ~kExponent) | 1,
                        kExponent,
                        kExponent | kSign,
                        kExponent - 1,
                        (kExponent - 1) | kSign,
                        1,
                        0,
                        kSign};
    const std::uint64_t which = random_();
    Bits bits = static_cast<Bits>(random_());
    if (which % 2 == 0) bits = odd[which / 2 % 8];
    if (which % 4 == 1) {
      const Real usual[] = {Real(0.05), Real(1.5), Real(3), Real(-1.2), Real(100), Real(2.9), Real(6), Real(-0.3)};
      return usual[which / 4 % 8];
    }
    Real value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  template <class T>
  Rotors<T> four() {
    return {T(next()), T(next()), T(next()), T(next())};
  }

 private:
  std::mt19937_64 random_;
};

long seen = 0, bad = 0;

void see(const Real& value, Real low, Real high) {
  ++seen;
  bad += is_nan(value) || !is_finite(value) || value < low || value > high ? 1 : 0;
}

Compensator compensator_of(int kind) {
  const auto overlap = static_cast<OverlapMeasure>(kind % 3);
  const ThrustCoefficient k(Real(1.55e-6));
  auto curve = ThrustCurve::from_line(k, k * Real(1.03), Real(-2.56e-7), Radians(Real(4.71)), overlap);
  if (kind % 2 == 0) (void)curve->set_speed_trend({Real(1e-4), RadPerSec(1000)});
  Airframe airframe{Metres(Real(0.045)), Metres(Real(0.117)), Metres(Real(0.0635)), RadPerSec(0), RadPerSec(2000)};
  airframe.overlap = overlap;
  if (kind % 4 == 3) {
    airframe.polygon.emplace(ConvexPolygon::square(Metres(Real(0.045))));
    for (int i = 0; i < 4; ++i) {
      const Position corner = airframe.polygon->outline.corner(static_cast<std::size_t>(i));
      airframe.polygon->hinges.add({corner, Radians(Real(i) * kPi / 2)});
    }
  }
  const auto law = kind % 5 == 0 ? ScalingLaw::published : ScalingLaw::clamped;
  return *Compensator::build(Rotors<ThrustCurve>(4, *curve), airframe, law).compensator;
}

void fly(Compensator& compensator, Mixer& mixer, const RotorLayout& good, Odd& odd) {
  if (odd.next() > 0) {
    Rotors<HubPosition> hubs;
    for (int i = 0; i < 4; ++i) hubs.add({Metres(odd.next()), Metres(odd.next())});
    compensator.set_hubs(hubs, {Seconds(odd.next()), odd.four<Real>()});
  } else {
    compensator.set_arms(odd.four<Radians>(), {Seconds(odd.next()), odd.four<RadPerSec>()});
  }
  (void)compensator.set_air_density_ratio(odd.next());
  const SpeedCommand command = compensator.speeds_for(odd.four<Newtons>());
  const Rotors<Newtons> uncovered = compensator.uncovered_thrusts(odd.four<Newtons>());
  RotorLayout layout = good;
  layout.hubs[odd.next() > 0 ? 1 : 2] = {Metres(odd.next()), Metres(odd.next())};
  (void)mixer.set_layout(layout, odd.four<Real>());
  (void)mixer.set_layout(compensator.layout({odd.next(), {}, odd.four<Real>()}, good.spins), compensator.drag_scale());
  const MixedThrusts mixed =
      mixer.mix({Newtons(odd.next()), NewtonMetres(odd.next()), NewtonMetres(odd.next()), NewtonMetres(odd.next())},
                {odd.four<Newtons>(), odd.four<Newtons>()}, NewtonMetres(odd.next()));
  for (std::size_t i = 0; i < 4; ++i) {
    see(command.speeds[i].value(), 0, 2000);
    see(compensator.occlusion_angles()[i].value(), 0, 2 * kPi);
    see(compensator.scaling_factors()[i], -1000, 1);
    see(compensator.thrust_max()[i].value(), 0, 100);
    see(compensator.drag_scale()[i], Real(0.1), 100);
    see(uncovered[i].value(), 0, 1000);
    see(ThrottleCurve{Newtons(6), Real(0.4)}.throttle_for(Newtons(odd.next())), 0, 1);
    see(mixed.thrusts[i].value(), 0, Real(1e9));
  }
  const Real most = Real(1e25);
  see(mixed.achieved.thrust.value(), 0, most);
  see(mixed.achieved.roll.value(), -most, most);
  see(mixed.achieved.pitch.value(), -most, most);
  see(mixed.achieved.yaw.value(), -most, most);
}

}  // namespace

int main() {
  constexpr int kKinds = 60, kFlights = 1'700;
  const RotorLayout good{
      {Position{Metres(Real(0.13)), Metres(Real(0.13))}, Position{Metres(Real(-0.13)), Metres(Real(0.13))},
       Position{Metres(Real(-0.13)), Metres(Real(-0.13))}, Position{Metres(Real(0.13)), Metres(Real(-0.13))}},
      {1, -1, 1, -1}};
  for (int kind = 0; kind < kKinds; ++kind) {
    Odd odd(static_cast<unsigned>(kind));
    Compensator compensator = compensator_of(kind);
    Mixer mixer = *Mixer::build(good, {Metres(Real(0.0133)), kind % 2 == 0 ? Real(0) : Real(1e-4)});
    for (int i = 0; i < kFlights; ++i) fly(compensator, mixer, good, odd);
  }
  std::printf("%ld results, %ld bad\n", seen, bad);
  return bad == 0 ? 0 : 1;
}
