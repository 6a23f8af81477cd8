// The whole job of a flight, in the number that this file is compiled for.
#pragma once

#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"
#include "test/compensation/float_side.hpp"

namespace kphi::test {

inline std::optional<compensation::ThrustCurve> curve_of(const Vehicle& vehicle, compensation::OverlapMeasure overlap) {
  using namespace compensation;
  const Radians largest(Real(4.7));
  const Knot shares[] = {{Radians(0), 1}, {from_degrees(270), vehicle.torque_covered}};
  Knot knots[5] = {{Radians(0), vehicle.thrust_coefficient}};
  for (int i = 0; i < 4; ++i)
    knots[i + 1] = {from_degrees(Real(i < 2 ? 45 * (i + 1) : 90 * i)), vehicle.thrust_coefficient * vehicle.knots[i]};
  const auto table = OcclusionTable::from(knots, vehicle.table ? 5 : 0);
  auto curve =
      table ? ThrustCurve::from_table(*table, largest, overlap)
            : ThrustCurve::from_line(ThrustCoefficient(vehicle.thrust_coefficient),
                                     ThrustCoefficient(vehicle.intercept), vehicle.slope_per_rad, largest, overlap);
  const auto share = OcclusionTable::from(shares, 2);
  if (!curve || !share || !curve->set_torque_share(*share)) return std::nullopt;
  if (!curve->set_speed_trend({vehicle.trend / vehicle.fastest_speed, RadPerSec(vehicle.fastest_speed / 2)}))
    return std::nullopt;
  return curve;
}

/// Numbers is Flown, or the same in double.
template <class Numbers>
Numbers flown(const Vehicle& vehicle) {
  using namespace compensation;
  using Number = std::remove_reference_t<decltype(Numbers::speeds[0])>;
  Numbers result{};
  const auto overlap = static_cast<OverlapMeasure>(vehicle.overlap);
  const auto curve = curve_of(vehicle, overlap);
  Airframe airframe{Metres(vehicle.half_side), Metres(vehicle.arm_length), Metres(vehicle.propeller_radius),
                    RadPerSec(0), RadPerSec(vehicle.fastest_speed)};
  airframe.overlap = overlap;
  if (!curve) return result;
  const BuildOutcome built =
      Compensator::build(Rotors<ThrustCurve>(4, *curve), airframe, static_cast<ScalingLaw>(vehicle.law));
  if (!built.compensator) return result;
  Compensator compensator = *built.compensator;
  compensator.set_arms(
      {Radians(vehicle.arms[0]), Radians(vehicle.arms[1]), Radians(vehicle.arms[2]), Radians(vehicle.arms[3])});
  const RotorLayout layout = compensator.layout({Real(0.4), {}, Rotors<Real>(4, Real(0.05))}, {1, -1, 1, -1});
  auto mixer = Mixer::build(layout, {Metres(Real(0.0133)), 0});
  if (!mixer || !mixer->set_layout(layout, compensator.drag_scale())) return result;
  result.built = true;
  const Wrench demand{Newtons(vehicle.demand[0]), NewtonMetres(vehicle.demand[1]), NewtonMetres(vehicle.demand[2]),
                      NewtonMetres(vehicle.demand[3])};
  const MixedThrusts mixed = mixer->mix(demand, {{}, compensator.thrust_max()}, NewtonMetres(vehicle.assured_yaw));
  const SpeedCommand command = compensator.speeds_for(mixed.thrusts);
  for (std::size_t i = 0; i < 4; ++i) {
    result.speeds[i] = static_cast<Number>(command.speeds[i].value());
    result.thrusts[i] = static_cast<Number>(mixed.thrusts[i].value());
    result.occlusions[i] = static_cast<Number>(compensator.occlusion_angles()[i].value());
    result.thrust_max[i] = static_cast<Number>(compensator.thrust_max()[i].value());
    result.flags[i] = command.flags[i].bits();
  }
  result.concessions = mixed.concessions.bits();
  result.achieved[0] = static_cast<Number>(mixed.achieved.thrust.value());
  result.achieved[1] = static_cast<Number>(mixed.achieved.roll.value());
  result.achieved[2] = static_cast<Number>(mixed.achieved.pitch.value());
  result.achieved[3] = static_cast<Number>(mixed.achieved.yaw.value());
  return result;
}

}  // namespace kphi::test
