#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "base/number.hpp"
#include "fit/export/facts.hpp"

namespace kphi::fit {
namespace {

/// A backslash at the end of a comment's line would take in the next.
std::string comment_safe(std::string text) {
  std::ranges::replace(text, '\\', '/');
  return text;
}

std::string real(double value) {
  return std::isfinite(value) ? "(kphi_real)" + yaml_number(value) : std::string("(kphi_real)HUGE_VAL");
}

/// A function that returns a struct, field by field: it stays right if the struct grows or changes its order.
class StructText {
 public:
  StructText(const std::string& type, const std::string& name, const std::string& what)
      : text_(fmt::format("\n/* {} */\nstatic inline {} {}(void) {{\n  {} made;\n  memset(&made, 0, sizeof made);\n",
                          comment_safe(what), type, name, type)) {}
  void real_field(const std::string& field, double value) { set(field, real(value)); }
  void set(const std::string& field, const std::string& value) {
    text_ += fmt::format("  made.{} = {};\n", field, value);
  }
  void knots(const std::string& count, const std::string& field, const std::vector<compensation::Knot>& knots,
             double scale) {
    set(count, fmt::format("{}", knots.size()));
    for (std::size_t i = 0; i < knots.size(); ++i) {
      real_field(fmt::format("{}[{}].phi_rad", field, i), knots[i].occlusion.value());
      real_field(fmt::format("{}[{}].value", field, i), scale * knots[i].value);
      real_field(fmt::format("{}[{}].error", field, i), scale * knots[i].standard_error);
    }
  }
  [[nodiscard]] std::string text() && { return std::move(text_) + "  return made;\n}\n"; }

 private:
  std::string text_;
};

const char* overlap_code(compensation::OverlapMeasure measure) {
  constexpr const char* kCodes[] = {"KPHI_RIM_ARC", "KPHI_AREA_SHARE", "KPHI_LOAD_SHARE"};
  return kCodes[static_cast<std::size_t>(measure)];
}

std::string curve_in_c(const compensation::Coefficients& file, const std::string& name) {
  const CurveNumbers numbers = numbers_of(file);
  StructText curve("kphi_curve", name + "_curve", "k(phi), torque and change with the speed of one propeller.");
  curve.real_field("thrust_coefficient", numbers.k_t);
  file.curve.visit(
      [&](const compensation::Line& line) {
        curve.real_field("intercept", line.intercept.value());
        curve.real_field("slope_per_rad", line.slope_per_rad);
        if (!line.uncertainty) return;
        curve.set("has_uncertainty", "1");
        curve.real_field("thrust_coefficient_error", line.uncertainty->thrust_coefficient);
        curve.real_field("intercept_variance", line.uncertainty->intercept_variance);
        curve.real_field("covariance", line.uncertainty->covariance);
        curve.real_field("slope_variance", line.uncertainty->slope_variance);
      },
      [&](const compensation::OcclusionTable& table) {
        curve.knots("knot_count", "knots", {table.begin(), table.end()}, 1);
      });
  curve.real_field("largest_fitted_rad", file.curve.largest_fitted().value());
  curve.set("overlap", overlap_code(file.curve.overlap()));
  if (!numbers.torque.empty()) curve.knots("torque_count", "torque", numbers.torque, 1);
  if (numbers.trend.per_rad_s != 0) {
    curve.real_field("trend_per_rad_s", numbers.trend.per_rad_s);
    curve.real_field("trend_reference", numbers.trend.reference.value());
  }
  return std::move(curve).text();
}

std::string airframe_in_c(const FlownVehicle& vehicle, const std::string& name) {
  const compensation::Airframe& airframe = vehicle.airframe;
  const std::size_t rotors = compensation::rotors_of(airframe);
  StructText text("kphi_airframe", name + "_airframe", "Body, arms and speeds.");
  text.real_field("half_side", airframe.half_side.value());
  text.real_field("arm_length", airframe.arm_length.value());
  text.real_field("propeller_radius", airframe.propeller_radius.value());
  text.real_field("slowest_speed", airframe.slowest_speed.value());
  text.real_field("fastest_speed", airframe.fastest_speed.value());
  text.set("rotors", fmt::format("{}", rotors));
  text.set("overlap", overlap_code(airframe.overlap));
  text.set("has_arm_limits", "1");
  text.real_field("arm_from_rad", airframe.arms.from.value());
  text.real_field("arm_to_rad", airframe.arms.to.value());
  text.real_field("arm_stale_rad", airframe.arms.stale.value());
  const auto at = [&](const char* field, std::size_t i, const compensation::Position& position) {
    text.real_field(fmt::format("{}[{}][0]", field, i), position.x.value());
    text.real_field(fmt::format("{}[{}][1]", field, i), position.y.value());
  };
  if (airframe.polygon) {
    text.set("corner_count", fmt::format("{}", airframe.polygon->outline.size()));
    for (std::size_t i = 0; i < airframe.polygon->outline.size(); ++i)
      at("corners", i, airframe.polygon->outline.corner(i));
    for (std::size_t more = 0; more < airframe.polygon->more.size(); ++more) {
      const auto& part = airframe.polygon->more[more];
      if (!part) continue;
      text.set(fmt::format("more_corner_counts[{}]", more), fmt::format("{}", part->size()));
      for (std::size_t i = 0; i < part->size(); ++i)
        at(fmt::format("more_corners[{}]", more).c_str(), i, part->corner(i));
    }
  }
  for (std::size_t i = 0; i < rotors; ++i) {
    const bool mirrored = airframe.polygon ? airframe.polygon->hinges[i].mirrored : airframe.mirrored[i];
    text.set(fmt::format("mirrored[{}]", i), mirrored ? "1" : "0");
    if (!airframe.polygon) text.set(fmt::format("hinge_turns[{}]", i), fmt::format("{}", airframe.hinge_turns[i]));
    if (!airframe.polygon) continue;
    at("hinges", i, airframe.polygon->hinges[i].at);
    text.real_field(fmt::format("hinge_turn_rad[{}]", i), airframe.polygon->hinges[i].turn.value());
  }
  return std::move(text).text();
}

std::string vehicle_in_c(const FlownVehicle& vehicle, const std::string& name) {
  StructText masses("kphi_masses", name + "_masses", "What moves the centre of gravity with the arms.");
  masses.real_field("body", vehicle.masses.body);
  masses.real_field("body_at[0]", vehicle.masses.body_at.x.value());
  masses.real_field("body_at[1]", vehicle.masses.body_at.y.value());
  std::vector<int> spins(vehicle.spins.begin(), vehicle.spins.end());
  std::vector<std::string> angles;
  for (std::size_t i = 0; i < spins.size(); ++i)
    masses.real_field(fmt::format("at_hubs[{}]", i), vehicle.masses.at_hubs[i]);
  for (const Radians angle : vehicle.reference) angles.push_back(real(angle.value()));
  for (const compensation::HubPosition& hub : vehicle.reference_hubs)
    angles.push_back(fmt::format("{{{}, {}}}", real(hub.x.value()), real(hub.y.value())));
  const bool by_hubs = vehicle.reference_hubs.size() != 0;
  return airframe_in_c(vehicle, name) + std::move(masses).text() +
         fmt::format(
             "\n#define {0}_ROTORS {1}\nstatic const int {0}_SPINS[{1}] = {{{2}}}; /* +1: its drag torque points up "
             "*/\n"
             "#define {0}_DRAG_PER_NEWTON {3} /* m, without occlusion */\n"
             "static const kphi_real {0}_REFERENCE_{6} = {{{4}}}; /* {7} of {5} */\n",
             name, spins.size(), fmt::join(spins, ", "), real(vehicle.drag_per_newton), fmt::join(angles, ", "),
             comment_safe(one_line(vehicle.reference_name)),
             by_hubs ? fmt::format("M[{}][2]", spins.size()) : fmt::format("RAD[{}]", spins.size()),
             by_hubs ? "hubs, for kphi_set_hubs," : "arm angles");
}

}  // namespace

/// For kphi_compensation.h, in float or double as the library was built.
Export to_c(const compensation::Coefficients& file, const ExportOptions& options) {
  require_curve(file, "kphi_curve");
  const std::string name = identifier(file.propeller.id);
  Export result;
  for (const std::string& line : provenance_lines(file)) result.text += "// " + comment_safe(line) + "\n";
  result.text += fmt::format(
      "#ifndef {0}_H\n#define {0}_H\n\n#include <math.h>\n#include <string.h>\n\n"
      "#include \"compensation/kphi_compensation.h\"\n\n"
      "#define {0}_SIMULATED {1} /* 1: not by devices */\n#define {0}_ORIGIN {2}\n#define {0}_VERDICT {3}\n",
      name, is_simulated(file) ? 1 : 0, json_text(origin_words(file)), json_text(verdict_words(file)));
  const auto number = [&](const char* what, double value, const char* unit) {
    result.text += fmt::format("#define {}_{} {} /* {} */\n", name, what, real(value), unit);
  };
  if (file.slowest_speed) number("SLOWEST_MEASURED", file.slowest_speed->value(), "rad/s");
  if (file.fastest_speed) number("FASTEST_MEASURED", file.fastest_speed->value(), "rad/s");
  if (file.air_density_kg_m3) number("AIR_DENSITY", *file.air_density_kg_m3, "kg/m3, of the fit");
  result.text += curve_in_c(file, name);
  if (const auto vehicle = flown_vehicle(file, options))
    result.text += vehicle_in_c(*vehicle, identifier(vehicle->name));
  result.text += "\n#endif\n";
  result.lost = {
      "the measured k per occlusion, hashes of the runs: the header is for the flight, which only needs k(phi)"};
  if (options.vehicle == nullptr) result.lost.emplace_back("body and arms: name the vehicle with --vehicle");
  return result;
}

}  // namespace kphi::fit
