#include <fmt/format.h>

#include "base/device_data.hpp"
#include "base/number.hpp"
#include "fit/export/facts.hpp"

namespace kphi::fit {
namespace {

struct Parameters {
  std::string text, unknown;

  void add(const std::string& key, const std::string& value) { text += "      " + key + ": " + value + "\n"; }
  template <class Values, class Word>
  void words(const std::string& key, const Values& values, const Word& word) {
    std::string joined;
    for (const auto& value : values) joined += (joined.empty() ? "" : ", ") + word(value);
    add(key, "[" + joined + "]");
  }
  void number(const std::string& key, std::optional<double> value) {
    if (value) add(key, yaml_number(*value));
    if (!value) unknown += (unknown.empty() ? "" : ", ") + key;
  }
  void list(const std::string& key, const std::vector<double>& values) {
    std::string joined;
    for (const double value : values) joined += (joined.empty() ? "" : ", ") + yaml_number(value);
    add(key, "[" + joined + "]");
  }
};

template <class Unit>
std::optional<double> value_of(const std::optional<Quantity<Unit>>& quantity) {
  return quantity ? std::optional(quantity->value()) : std::nullopt;
}

void add_table(const compensation::Coefficients& file, Parameters& parameters) {
  std::vector<double> angles, coefficients, u, expanded;
  for (const auto& row : file.table) {
    angles.push_back(to_degrees(row.occlusion));
    coefficients.push_back(row.k.value());
    if (!row.uncertainty) continue;
    u.push_back(row.uncertainty->u);
    expanded.push_back(row.uncertainty->expanded_95);
  }
  if (angles.empty()) return;
  parameters.list("phi_deg", angles);
  parameters.list("k_n_s2_per_rad2", coefficients);
  if (u.size() != angles.size()) return;
  parameters.list("k_u_n_s2_per_rad2", u);
  parameters.list("k_expanded_95_n_s2_per_rad2", expanded);
}

void add_curve(const compensation::ThrustCurve& curve, Parameters& parameters) {
  curve.visit(
      [&](const compensation::Line& line) {
        parameters.number("line_intercept_n_s2_per_rad2", line.intercept.value());
        parameters.number("line_slope_n_s2_per_rad3", line.slope_per_rad);
        if (const auto& u = line.uncertainty)
          parameters.list("line_covariance", {u->intercept_variance, u->covariance, u->covariance, u->slope_variance});
      },
      [&](const compensation::OcclusionTable& table) {
        std::vector<double> phi, k;
        for (const compensation::Knot& knot : table) phi.push_back(knot.occlusion.value()), k.push_back(knot.value);
        parameters.list("curve_phi_rad", phi);
        parameters.list("curve_k_n_s2_per_rad2", k);
      });
  parameters.number("phi_max_rad", curve.largest_fitted().value());
}

/// The names of integrations/ros2_compensator_node.cpp. Joints: arm_1 and so on, unless the robot has other names.
std::string vehicle_parameters(const FlownVehicle& vehicle) {
  const compensation::Airframe& airframe = vehicle.airframe;
  Parameters parameters;
  std::vector<std::string> joints;
  for (std::size_t i = 0; i < vehicle.reference.size(); ++i) joints.push_back(fmt::format("arm_{}", i + 1));
  parameters.words("joints", joints, [](const std::string& name) { return json_text(name); });
  parameters.number("arm_length_m", airframe.arm_length.value());
  parameters.number("propeller_radius_m", airframe.propeller_radius.value());
  parameters.number("speed_min_rad_s", airframe.slowest_speed.value());
  parameters.number("speed_max_rad_s", airframe.fastest_speed.value());
  parameters.number("arm_angle_min_rad", airframe.arms.from.value());
  parameters.number("arm_angle_max_rad", airframe.arms.to.value());
  parameters.number("arm_stale_rad", airframe.arms.stale.value());
  std::vector<double> turns, x, y, corner_x, corner_y,
      hubs(vehicle.masses.at_hubs.begin(), vehicle.masses.at_hubs.end());
  std::vector<bool> mirrored;
  for (std::size_t i = 0; i < vehicle.reference.size(); ++i) {
    const bool square = !airframe.polygon;
    turns.push_back(square ? kPi / 2 * airframe.hinge_turns[i] : airframe.polygon->hinges[i].turn.value());
    mirrored.push_back(square ? airframe.mirrored[i] : airframe.polygon->hinges[i].mirrored);
    if (square) continue;
    x.push_back(airframe.polygon->hinges[i].at.x.value());
    y.push_back(airframe.polygon->hinges[i].at.y.value());
  }
  parameters.list("hinge_turn_rad", turns);
  parameters.words("arm_mirrored", mirrored, [](bool one) { return std::string(one ? "true" : "false"); });
  if (!airframe.polygon) parameters.number("half_side_m", airframe.half_side.value());
  for (std::size_t i = 0; airframe.polygon && i < airframe.polygon->outline.size(); ++i) {
    corner_x.push_back(airframe.polygon->outline.corner(i).x.value());
    corner_y.push_back(airframe.polygon->outline.corner(i).y.value());
  }
  if (airframe.polygon) {
    parameters.list("corner_x_m", corner_x);
    parameters.list("corner_y_m", corner_y);
    parameters.list("hinge_x_m", x);
    parameters.list("hinge_y_m", y);
  }
  parameters.number("body_mass_kg", vehicle.masses.body);
  parameters.list("body_at_m", {vehicle.masses.body_at.x.value(), vehicle.masses.body_at.y.value()});
  parameters.list("hub_mass_kg", hubs);
  parameters.words("rotor_spins", vehicle.spins, [](int spin) { return fmt::format("{}", spin); });
  parameters.number("drag_per_newton_m", vehicle.drag_per_newton);
  return "    vehicle:\n" + parameters.text;
}

}  // namespace

/// A parameter file for any node, and with a vehicle for kphi's own. Arrays are of one type, and a double must look
/// like one (45.0, not 45).
Export to_ros2(const compensation::Coefficients& file, const ExportOptions& options) {
  Parameters parameters;
  parameters.add("propeller", json_text(file.propeller.id));
  parameters.add("origin", json_text(name_of(origin_named(file.origin))));
  parameters.add("verdict", json_text(file.verdict.empty() ? "unknown" : file.verdict));
  parameters.add("overlap", fmt::format("\"{}\"", compensation::name_of(file.curve.overlap())));
  parameters.number("thrust_coefficient_n_s2_per_rad2", file.curve.thrust_coefficient().value());
  const auto& K_T = file.thrust_coefficient;
  parameters.number("thrust_coefficient_u_n_s2_per_rad2", K_T ? std::optional(K_T->u) : std::nullopt);
  parameters.number("thrust_coefficient_expanded_95_n_s2_per_rad2",
                    K_T ? std::optional(K_T->expanded_95) : std::nullopt);
  if (!file.alone()) add_curve(file.curve, parameters);
  if (const auto torque = torque_per_thrust(file, 0)) {
    parameters.number("torque_per_thrust_m", torque->value);
    parameters.number("torque_per_thrust_expanded_95_m", torque->expanded_95);
  }
  if (const auto numbers = numbers_of(file); !numbers.torque.empty()) {
    std::vector<double> phi, share;
    for (const compensation::Knot& knot : numbers.torque)
      phi.push_back(knot.occlusion.value()), share.push_back(knot.value);
    parameters.list("torque_phi_rad", phi);
    parameters.list("torque_share", share);
  }
  if (const auto& trend = file.curve.speed_trend(); trend.per_rad_s != 0) {
    parameters.number("speed_trend_s_per_rad", trend.per_rad_s);
    parameters.number("speed_trend_reference_rad_s", trend.reference.value());
  }
  parameters.number("speed_min_rad_s", value_of(file.slowest_speed));
  parameters.number("speed_max_rad_s", value_of(file.fastest_speed));
  parameters.number("air_density_kg_m3", file.air_density_kg_m3);
  add_table(file, parameters);
  Export result;
  result.text = comment(file, "# ") + "/**:\n  ros__parameters:\n    kphi:\n" + parameters.text;
  if (const auto vehicle = flown_vehicle(file, options)) result.text += vehicle_parameters(*vehicle);
  result.lost = {
      "hashes of the runs: only in the coefficient file",
      "the covariance's shape: parameters have no matrices; it is row by row, in the order of the parameters"};
  if (file.alone()) result.lost.push_back(no_phi(file, "the file", 0));
  if (options.vehicle == nullptr && !file.alone())
    result.lost.emplace_back("body and arms: kphi's node needs them; name the vehicle with --vehicle");
  if (!parameters.unknown.empty())
    result.lost.push_back("unknown values: parameters have no null; left out: " + parameters.unknown);
  return result;
}

}  // namespace kphi::fit
