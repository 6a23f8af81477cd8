#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "base/number.hpp"
#include "fit/export/facts.hpp"

namespace kphi::fit {
namespace {

/// Lines of a .params file.
class ParameterText {
 public:
  void number(const std::string& name, double value) { add(name, shortest(value), kReal32); }
  void whole(const std::string& name, int value) { add(name, fmt::format("{}", value), kInt32); }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  static constexpr int kInt32 = 6, kReal32 = 9;  // MAV_PARAM_TYPE_…

  void add(const std::string& name, const std::string& value, int type) {
    text_ += fmt::format("1\t1\t{}\t{}\t{}\n", name, value, type);
  }

  std::string text_;
};

void add_knots(ParameterText& to, const char* prefix, const std::string& count,
               const std::vector<compensation::Knot>& knots) {
  to.whole(count, static_cast<int>(knots.size()));
  for (std::size_t i = 0; i < knots.size(); ++i) {
    to.number(fmt::format("{}_PHI{}", prefix, i), to_degrees(knots[i].occlusion));
    to.number(fmt::format("{}{}", prefix, i), knots[i].value);
  }
}

/// The propeller, for the child: integrations/px4_parameters.yaml.
void add_curve(ParameterText& to, const compensation::Coefficients& file, double speed_max) {
  const CurveNumbers numbers = numbers_of(file);
  to.number("KPHI_W_MAX", speed_max);
  to.number("KPHI_PHI_MAX", to_degrees(file.curve.largest_fitted()));
  to.whole("KPHI_OVERLAP", static_cast<int>(file.curve.overlap()));
  to.number("KPHI_LINE_K", numbers.line_start);
  to.number("KPHI_LINE_S", numbers.line_slope * kPi / 180);
  add_knots(to, "KPHI_K", "KPHI_K_N", numbers.k);
  add_knots(to, "KPHI_TQ", "KPHI_TQ_N", numbers.torque);
  to.number("KPHI_TREND", numbers.trend.per_rad_s);
  to.number("KPHI_TREND_W", numbers.trend.reference.value());
  to.whole("KPHI_ORIGIN", origin_code(file));
  to.whole("KPHI_VERDICT", verdict_code(file));
}

void add_geometry(ParameterText& to, const FlownVehicle& vehicle) {
  const compensation::Airframe& airframe = vehicle.airframe;
  to.number("KPHI_HALF_SIDE", airframe.half_side.value());
  to.number("KPHI_ARM", airframe.arm_length.value());
  to.number("KPHI_PROP_R", airframe.propeller_radius.value());
  to.number("KPHI_ARM_MIN", to_degrees(airframe.arms.from));
  to.number("KPHI_ARM_MAX", to_degrees(airframe.arms.to));
  to.number("KPHI_ARM_STALE", to_degrees(airframe.arms.stale));
  to.number("KPHI_M_BODY", vehicle.masses.body);
  to.number("KPHI_M_X", vehicle.masses.body_at.x.value());
  to.number("KPHI_M_Y", vehicle.masses.body_at.y.value());
  to.number("KPHI_M_HUB", vehicle.masses.at_hubs[0]);
  to.whole("KPHI_C_N", airframe.polygon ? static_cast<int>(airframe.polygon->outline.size()) : 0);
  for (std::size_t i = 0; airframe.polygon && i < airframe.polygon->outline.size(); ++i) {
    to.number(fmt::format("KPHI_C{}_X", i), airframe.polygon->outline.corner(i).x.value());
    to.number(fmt::format("KPHI_C{}_Y", i), airframe.polygon->outline.corner(i).y.value());
  }
  for (std::size_t i = 0; i < vehicle.reference.size(); ++i) {
    to.number(fmt::format("KPHI_REF{}", i), to_degrees(vehicle.reference[i]));
    if (!airframe.polygon) {
      to.number(fmt::format("KPHI_H{}_TURN", i), 90.0 * airframe.hinge_turns[i]);
      to.whole(fmt::format("KPHI_H{}_MIRR", i), airframe.mirrored[i] ? 1 : 0);
      continue;
    }
    const compensation::Hinge& hinge = airframe.polygon->hinges[i];
    to.number(fmt::format("KPHI_H{}_TURN", i), to_degrees(hinge.turn));
    to.whole(fmt::format("KPHI_H{}_MIRR", i), hinge.mirrored ? 1 : 0);
    to.number(fmt::format("KPHI_H{}_X", i), hinge.at.x.value());
    to.number(fmt::format("KPHI_H{}_Y", i), hinge.at.y.value());
  }
}

/// The motors of PX4's own multirotor in the reference shape, which the child reads, too; y points to the right there.
void add_rotors(ParameterText& to, const FlownVehicle& vehicle) {
  to.whole("CA_ROTOR_COUNT", static_cast<int>(vehicle.reference.size()));
  for (std::size_t i = 0; i < vehicle.reference.size(); ++i) {
    to.number(fmt::format("CA_ROTOR{}_PX", i), vehicle.reference_layout.hubs[i].x.value());
    to.number(fmt::format("CA_ROTOR{}_PY", i), -vehicle.reference_layout.hubs[i].y.value());
    to.number(fmt::format("CA_ROTOR{}_KM", i), -vehicle.spins[i] * vehicle.drag_per_newton);
  }
}

/// Of a vehicle that the file does not know: what of the motors' torque can be written.
void add_turns(ParameterText& to, const compensation::Coefficients& file, const ExportOptions& options,
               Export& result) {
  const auto moment = torque_per_thrust(file, options.phi_deg);
  for (std::size_t motor = 0; moment && motor < options.turns.size(); ++motor)
    to.number(fmt::format("CA_ROTOR{}_KM", motor),
              options.turns[motor] == Turn::clockwise ? -moment->value : moment->value);
  if (!moment) result.lost.emplace_back(kNoTorque);
  if (moment && options.turns.empty())
    result.lost.push_back(
        fmt::format("CA_ROTORn_KM: {}, negative for a rotor that turns clockwise; name the "
                    "directions with --turns ccw,ccw,cw,cw to have it written",
                    words_of(*moment)));
  result.lost.emplace_back("body and arms: name the vehicle with --vehicle for the morphing child");
}

/// How the outputs become thrust; a line for the file's head.
std::string add_throttle(ParameterText& to, const compensation::Coefficients& file, Export& result) {
  const auto* const law = file.throttle_law("px4");
  if (law == nullptr) {
    to.number("THR_MDL_FAC", 1);
    result.lost.emplace_back(
        "THR_MDL_FAC 1.0 is right only for motors that hold a commanded speed; ordinary speed controllers need 0.2 to "
        "0.5: import a log with throttle, and fit and export that");
    return "# THR_MDL_FAC 1.0: only for motors that hold a commanded speed\n";
  }
  const double fitted = number_of(file, *law, "THR_MDL_FAC"), taken = std::clamp(fitted, 0.0, 1.0);
  to.number("THR_MDL_FAC", taken);
  const std::string words = words_of(*law, "THR_MDL_FAC") + "; for 1000 to 2000 us, or the ends of the log's throttle";
  result.lost.push_back("interval of the throttle law: " + words);
  if (taken != fitted)
    result.lost.push_back(
        fmt::format("THR_MDL_FAC {:.3g}: PX4 takes 0 to 1 and counts others as 0; {:g} is written", fitted, taken));
  return "# " + words + "\n";
}

}  // namespace

/// Parameters as QGroundControl loads them. Control allocation takes thrust = CT u², u the normalised output, so that
/// CT = k ω_max² in N at full output. THR_MDL_FAC is that of the log's throttle; without one it is 1, which is true
/// where the output is proportional to speed (a speed-controlled motor). Torque = KM · thrust, KM in m, negative for a
/// rotor that turns clockwise: a wrong sign would crash the vehicle, so it is written only where the directions are
/// known. With a vehicle: all that the morphing child reads.
Export to_px4(const compensation::Coefficients& file, const ExportOptions& options) {
  constexpr double kLargestCt = 100;  // module.yaml of control_allocator
  const double speed_max = speed_max_of(file, options);
  const double ct = coefficient_at(file, options.phi_deg) * speed_max * speed_max;
  if (!(ct <= kLargestCt)) {
    throw ConfigurationError(
        fmt::format("{}: {:.1f} N at full output is above 100, the largest CA_ROTORn_CT; no file", file.path, ct));
  }
  require_turns(options);
  const auto vehicle = flown_vehicle(file, options);
  if (vehicle) require_arms(*vehicle, "px4");
  if (vehicle && options.phi_deg != 0)
    throw ConfigurationError(
        "--phi-deg with --vehicle: the morphing child takes CT without occlusion; leave one of the two out");
  Export result;
  ParameterText parameters;
  const int motors = vehicle ? static_cast<int>(vehicle->reference.size()) : options.motors;
  for (int motor = 0; motor < motors; ++motor) parameters.number(fmt::format("CA_ROTOR{}_CT", motor), ct);
  result.lost = {"rad/s: PX4 has only a normalised output; CT is for the speed at full output named above",
                 "uncertainties: PX4 has no such parameters; see its comments"};
  if (vehicle) {
    add_rotors(parameters, *vehicle);
    add_curve(parameters, file, speed_max);
    add_geometry(parameters, *vehicle);
    result.lost.emplace_back(
        "k(phi) in PX4's own multirotor: its CA_ROTORn_CT cannot change in flight; KPHI_... are for the morphing child "
        "(compensation/integrations/px4.md)");
  } else {
    result.lost.push_back(no_phi(file, "CA_ROTORn_CT", options.phi_deg));
    add_turns(parameters, file, options, result);
    say_trend(file, result);
  }
  const std::string throttle = add_throttle(parameters, file, result);
  result.text = comment(file, "# ") + throttle +
                fmt::format(
                    "# phi = {:g} deg; CT in N at {:.0f} RPM, thrust = CT u^2 with u proportional to speed\n"
                    "# Vehicle-Id Component-Id Name Value Type\n",
                    options.phi_deg, to_rpm(RadPerSec(speed_max))) +
                parameters.text();
  return result;
}

}  // namespace kphi::fit
