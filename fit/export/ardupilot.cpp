#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "base/number.hpp"
#include "fit/export/facts.hpp"

namespace kphi::fit {
namespace {

std::string knots_text(const std::vector<compensation::Knot>& knots) {
  std::string text;
  for (const compensation::Knot& knot : knots)
    text += fmt::format("{}{{{}, {}}}", text.empty() ? "" : ", ", yaml_number(knot.occlusion.value()),
                        yaml_number(knot.value));
  return "{" + text + "}";
}

std::string vehicle_in_lua(const FlownVehicle& vehicle) {
  const compensation::PolygonBody body = body_of(vehicle.airframe);
  std::string corners, hinges, spins, reference;
  for (std::size_t i = 0; i < body.outline.size(); ++i)
    corners += fmt::format("{}{{{}, {}}}", i == 0 ? "" : ", ", yaml_number(body.outline.corner(i).x.value()),
                           yaml_number(body.outline.corner(i).y.value()));
  for (std::size_t i = 0; i < body.hinges.size(); ++i) {
    const compensation::Hinge& hinge = body.hinges[i];
    const char* comma = i == 0 ? "" : ", ";
    hinges += fmt::format("    {{x = {}, y = {}, turn = {}, mirrored = {}}},\n", yaml_number(hinge.at.x.value()),
                          yaml_number(hinge.at.y.value()), yaml_number(hinge.turn.value()), hinge.mirrored);
    spins += fmt::format("{}{}", comma, vehicle.spins[i]);
    reference += comma + yaml_number(vehicle.reference[i].value());
  }
  return fmt::format(
      "local vehicle = {{  -- m, rad, kg; x forward, y left\n  corners = {{{}}},\n  hinges = {{\n{}  }},\n"
      "  arm = {}, propeller_radius = {},\n  spins = {{{}}},  -- 1: the drag torque points up\n"
      "  body = {{{}, {}, {}}},  -- kg without hubs, and where\n  hub_mass = {},\n  reference = {{{}}}  -- {}\n}}\n",
      corners, hinges, yaml_number(vehicle.airframe.arm_length.value()),
      yaml_number(vehicle.airframe.propeller_radius.value()), spins, yaml_number(vehicle.masses.body),
      yaml_number(vehicle.masses.body_at.x.value()), yaml_number(vehicle.masses.body_at.y.value()),
      yaml_number(vehicle.masses.at_hubs[0]), reference, one_line(vehicle.reference_name));
}

/// Of the two laws of a log the one with the voltage, where it describes the rows better.
Export expo_of(const compensation::Coefficients& file) {
  const auto* law = &throttle_law_for(file, "ardupilot");
  const auto* const by_voltage = file.throttle_law("ardupilot_voltage");
  const bool scaled = by_voltage != nullptr && by_voltage->rms_n < law->rms_n &&
                      std::ranges::count(law->not_told_from, by_voltage->name) == 0;
  if (scaled) law = by_voltage;
  const double fitted = number_of(file, *law, "MOT_THST_EXPO"), taken = std::clamp(fitted, -1.0, 1.0);
  Export result;
  result.text = comment(file, "# ") + "# " + words_of(*law, "MOT_THST_EXPO") + "\n" +
                fmt::format("MOT_THST_EXPO,{:.4f}\n", taken);
  for (const char* name : {"MOT_SPIN_MIN", "MOT_SPIN_MAX"})
    result.text += fmt::format("{},{:g}\n", name, number_of(file, *law, name));
  if (scaled) {
    result.text += fmt::format(
        "# the log's voltage is that at the motors: option 1 compensates by it, not by the resting voltage\n"
        "MOT_BAT_VOLT_MAX,{:.2f}\nMOT_OPTIONS,1\n",
        number_of(file, *law, "MOT_BAT_VOLT_MAX"));
    result.lost.emplace_back(
        "MOT_BAT_VOLT_MIN: the battery's, which the log does not know; below 0.6 of the largest ArduPilot ends at "
        "that");
  } else {
    result.lost.emplace_back(
        "MOT_BAT_VOLT_MAX, MOT_BAT_VOLT_MIN: the log does not tell how thrust goes with the voltage; the exponent is "
        "that of its supply");
  }
  result.lost.emplace_back(
      "MOT_SPIN_MIN, MOT_SPIN_MAX: ArduPilot's defaults, by which the exponent was fitted; with others it is another");
  if (taken != fitted)
    result.lost.push_back(fmt::format("MOT_THST_EXPO {:.3g}: ArduPilot takes -1 to 1; {:g} is written", fitted, taken));
  result.lost.emplace_back(
      "k: ArduPilot commands shares of a full motor; name the --vehicle for the script with k(phi)");
  return result;
}

}  // namespace

/// A script for AP_MotorsMatrix_Scripting_Dynamic: the factors of throttle, roll, pitch and yaw follow the arms.
Export to_ardupilot(const compensation::Coefficients& file, const ExportOptions& options) {
  const auto vehicle = flown_vehicle(file, options);
  if (!vehicle && file.throttle.empty())
    throw ConfigurationError(
        "--to ardupilot: the script computes k from arm angles; name the --vehicle; MOT_THST_EXPO alone needs a log "
        "with throttle");
  if (!vehicle) return expo_of(file);
  require_arms(*vehicle, "ardupilot");
  if (file.curve.overlap() != compensation::OverlapMeasure::rim_arc)
    throw ConfigurationError(
        fmt::format("{}: the script knows the rim_arc alone, these coefficients are flown with the {}", file.path,
                    compensation::name_of(file.curve.overlap())));
  CurveNumbers numbers = numbers_of(file);
  if (numbers.k.empty()) {
    const double end = file.curve.largest_fitted().value();
    numbers.k = {{Radians(0), numbers.line_start}, {Radians(end), numbers.line_start + numbers.line_slope * end}};
  }
  const auto& arms = vehicle->airframe.arms;
  Export result;
  for (const std::string& line : provenance_lines(file)) result.text += "-- " + line + "\n";
  result.text += fmt::format(
      "-- ArduPilot: put it into scripts/ of the card, SCR_ENABLE 1, FRAME_CLASS (Q_FRAME_CLASS) 17, MOT_THST_EXPO 1 "
      "where\n"
      "-- the motors follow a speed. Made by `kphi export --to ardupilot`; never flown.\n\n"
      "local propeller = {{  -- phi in rad, shares of K_T and of the torque at 0\n  k = {}, torque = {},\n"
      "  origin = {}, verdict = {}\n}}\n{}"
      "local arms = {{low = {}, high = {}, pwm_min = 1000, pwm_max = 2000}}  -- rad at these pulses, us\n\n",
      knots_text(numbers.k), knots_text(numbers.torque), json_text(origin_words(file)), json_text(verdict_words(file)),
      vehicle_in_lua(*vehicle), yaml_number(arms.from.value()), yaml_number(arms.to.value()));
  result.text += ardupilot_script();
  result.lost = {"thrust in N: ArduPilot commands shares of a full motor; K_T stays with MOT_THST_HOVER",
                 "measured arm angles: ArduPilot has none; the script takes what the servos are told",
                 "limits per rotor: ArduPilot's mixer knows 1 for each; a covered rotor reaches it earlier"};
  say_trend(file, result);
  return result;
}

}  // namespace kphi::fit
