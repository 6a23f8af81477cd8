#include "fit/export/facts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/device_data.hpp"
#include "base/error.hpp"
#include "base/number.hpp"
#include "compensation/compensator.hpp"
#include "compensation/flight/simulated_vehicle.hpp"
#include "compensation/mixing.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/uncertainty/readiness.hpp"
#include "profiles/vehicle.hpp"

namespace kphi::fit {
namespace {

/// "± 2.1e-09 (95 %, GUM; without calibration, which is unknown)".
std::string uncertainty_words(const compensation::Coefficients& file) {
  if (!file.thrust_coefficient) return "uncertainty unknown";
  std::string more;
  if (!file.assumed.empty()) more += fmt::format("; assumed in it: {}", fmt::join(file.assumed, ", "));
  if (!file.not_known.empty()) more += fmt::format("; unknown and not in it: {}", fmt::join(file.not_known, ", "));
  return fmt::format("± {:.2g} (95 %, GUM{})", file.thrust_coefficient->expanded_95, one_line(more));
}

}  // namespace

void require_curve(const compensation::Coefficients& file, const std::string& what) {
  if (!file.alone()) return;
  throw ConfigurationError(
      fmt::format("{}: K_T alone, no k(φ): {} needs occlusions; measure them with `kphi run`", file.path, what));
}

/// K_T k_i(φ), as it flies (ScalingLaw::clamped), N/(rad/s)². Throws ConfigurationError for a φ beyond the file's.
double coefficient_at(const compensation::Coefficients& file, double phi_deg) {
  if (phi_deg != 0) require_curve(file, "--phi-deg");
  if (!(phi_deg >= 0) || phi_deg > to_degrees(file.curve.largest_fitted()) + 1e-9) {
    throw ConfigurationError(fmt::format("{}: --phi-deg {} is outside the measured occlusions, 0 to {:g}", file.path,
                                         phi_deg, to_degrees(file.curve.largest_fitted())));
  }
  return file.curve.thrust_coefficient().value() * file.curve.scaling_factor(from_degrees(phi_deg));
}

/// rad/s at full output: the option, else the file's. Throws ConfigurationError without both.
double speed_max_of(const compensation::Coefficients& file, const ExportOptions& options) {
  if (options.speed_max_rpm) return from_rpm(*options.speed_max_rpm).value();
  if (options.vehicle != nullptr) return options.vehicle->speed_max.value();
  if (file.fastest_speed) return file.fastest_speed->value();
  throw ConfigurationError(file.path +
                           ": no range of speeds in the file; give the speed at full output with --speed-max-rpm");
}

/// Of a rotor at this φ: drag torque between the measured occlusions, over K_T k_i. nullopt: not measured.
std::optional<TorquePerThrust> torque_per_thrust(const compensation::Coefficients& file, double phi_deg) {
  if (file.torque.empty()) return std::nullopt;
  const double phi = from_degrees(phi_deg).value();
  const auto above = std::ranges::find_if(file.torque, [&](const auto& row) { return row.occlusion.value() >= phi; });
  const auto& right = above == file.torque.end() ? file.torque.back() : *above;
  const auto& left = above == file.torque.begin() || above == file.torque.end() ? right : *(above - 1);
  const double width = (right.occlusion - left.occlusion).value();
  const double part = width > 0 ? (phi - left.occlusion.value()) / width : 0;
  const double k_q = left.k_q + part * (right.k_q - left.k_q), k = coefficient_at(file, phi_deg);
  const auto share = [](const compensation::Coefficients::Torque& row) {
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    return row.per_thrust_expanded_95_m.value_or(unknown) / row.per_thrust_m.value_or(unknown);
  };
  TorquePerThrust result{k_q / k, std::nullopt};
  if (const double worst = std::max(share(left), share(right)); std::isfinite(share(left) + share(right)))
    result.expanded_95 = result.value * worst;
  return result;
}

/// "0.01226 ± 0.00009 m (95 %)".
std::string words_of(const TorquePerThrust& torque) {
  return torque.expanded_95 ? plain_with_error(torque.value, *torque.expanded_95) + " m (95 %)"
                            : fmt::format("{:.4g} m, ± unknown", torque.value);
}

std::string words_of(const compensation::Coefficients::ThrottleLaw& law, const std::string& number) {
  const auto* const found = law.find(number);
  std::string text = found == nullptr ? law.name
                                      : fmt::format("{} {} (95 %, by the scatter of the log's rows)", number,
                                                    plain_with_error(found->value, found->half_95));
  text += "; it holds for the supply and the speed controller of the log";
  if (!law.not_told_from.empty())
    text += fmt::format("; its rows cannot tell this law from that of {}", fmt::join(law.not_told_from, ", "));
  return one_line(text);
}

const compensation::Coefficients::ThrottleLaw& throttle_law_for(const compensation::Coefficients& file,
                                                                const std::string& name) {
  if (const auto* const law = file.throttle_law(name)) return *law;
  throw ConfigurationError(
      fmt::format("{}: no throttle law for {}: it needs a log with throttle{}; import one with `kphi import`, then "
                  "`kphi fit`",
                  file.path, name, name == "crazyflie" ? " and voltage" : ""));
}

double number_of(const compensation::Coefficients& file, const compensation::Coefficients::ThrottleLaw& law,
                 const std::string& name) {
  if (const auto* const number = law.find(name)) return number->value;
  throw ConfigurationError(
      fmt::format("{}: the throttle law {} has no {}; fit again with this kphi", file.path, one_line(law.name), name));
}

/// Throws ConfigurationError unless there is one direction for each motor, or none at all.
void require_turns(const ExportOptions& options) {
  if (options.turns.empty() || options.turns.size() == static_cast<std::size_t>(options.motors)) return;
  throw ConfigurationError(fmt::format("--turns names {} motors, but there are {}; name each, or set --motors",
                                       options.turns.size(), options.motors));
}

/// Control characters become blanks.
std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, ' ');
  return text;
}

bool is_simulated(const compensation::Coefficients& file) { return origin_named(file.origin) == Origin::simulated; }

/// "5x3, Cyclone T5040C; 1.23e-06 N/(rad/s)^2 at phi = 0 deg; measured …, fitted by kphi …; 15 runs", one line each.
std::vector<std::string> provenance_lines(const compensation::Coefficients& file) {
  const auto known = [](const std::string& text) { return text.empty() ? std::string("unknown") : one_line(text); };
  std::vector<std::string> lines{
      fmt::format("propeller {}, {}", known(file.propeller.id), known(file.propeller.name)),
      fmt::format("K_T {} N/(rad/s)^2, {}", yaml_number(file.curve.thrust_coefficient().value()),
                  uncertainty_words(file)),
      fmt::format("phi is meant as the {} of the overlap", compensation::name_of(file.curve.overlap())),
      fmt::format("origin: {}; verdict: {}", origin_words(file), verdict_words(file)),
      fmt::format("{} {}, campaign {}, {} runs, fitted by kphi {}", is_simulated(file) ? "simulated" : "measured",
                  known(file.measured_utc), known(file.provenance.campaign), file.provenance.runs.size(),
                  known(file.tool_version)),
      file.air_density_kg_m3 ? fmt::format("in air of {:.4g} kg/m3; k scales with density", *file.air_density_kg_m3)
                             : "air density unknown; k holds for the air of that day"};
  if (const auto torque = torque_per_thrust(file, 0))
    lines.push_back(fmt::format("torque per newton of thrust {}, without occlusion", words_of(*torque)));
  return lines;
}

/// Those lines, each behind `mark`.
std::string comment(const compensation::Coefficients& file, const std::string& mark) {
  std::string text;
  for (const std::string& line : provenance_lines(file)) text += mark + line + "\n";
  return text;
}

/// A double-quoted scalar that YAML and JSON read alike.
std::string json_text(const std::string& text) {
  return nlohmann::ordered_json(text).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Why a target with one constant loses k(φ).
std::string no_phi(const compensation::Coefficients& file, const char* target, double phi_deg) {
  if (file.alone()) return fmt::format("k(phi): no occlusion was measured; {} has K_T alone", target);
  return fmt::format(
      "k(phi): {} has one constant per motor and cannot change it in flight; this one is for phi = {:g} deg, use the "
      "compensation library for the others",
      target, phi_deg);
}

/// Nothing if k does not change with the speed.
void say_trend(const compensation::Coefficients& file, Export& result) {
  const auto& [per_rad_s, reference] = file.curve.speed_trend();
  if (per_rad_s == 0) return;
  result.lost.push_back(fmt::format("change of k with the speed: {:+.2g} % each 1000 RPM; k is that of {:.0f} RPM",
                                    100 * per_rad_s * from_rpm(1000).value(), to_rpm(reference)));
}

int origin_code(const compensation::Coefficients& file) {
  const Origin origin = origin_named(file.origin);
  return origin == Origin::measured ? 1 : origin == Origin::simulated ? 2 : 0;
}

int verdict_code(const compensation::Coefficients& file) {
  const auto readiness = readiness_named(file.verdict);
  return readiness ? 1 + static_cast<int>(std::min(*readiness, Readiness::not_yet)) : 0;
}

std::string identifier(const std::string& id) {
  std::string name = "kphi_";
  for (const char c : id) name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
}

CurveNumbers numbers_of(const compensation::Coefficients& file) {
  const compensation::ThrustCurve& curve = file.curve;
  CurveNumbers numbers;
  const double k_t = numbers.k_t = curve.thrust_coefficient().value();
  numbers.trend = curve.speed_trend();
  curve.visit(
      [&](const compensation::Line& line) {
        numbers.line_start = line.intercept.value() / k_t;
        numbers.line_slope = line.slope_per_rad / k_t;
      },
      [&](const compensation::OcclusionTable& table) {
        for (const compensation::Knot& knot : table)
          numbers.k.push_back({knot.occlusion, knot.value / k_t, knot.standard_error / k_t});
        numbers.line_slope = table.slope_at(Radians(0)) / k_t;
      });
  if (file.torque.size() < 2 || file.torque.size() > compensation::kMostKnots) return numbers;
  for (const auto& row : file.torque) numbers.torque.push_back({row.occlusion, curve.torque_share_at(row.occlusion)});
  return numbers;
}

compensation::PolygonBody body_of(const compensation::Airframe& airframe) {
  if (airframe.polygon) return *airframe.polygon;
  compensation::PolygonBody body{compensation::ConvexPolygon::square(airframe.half_side),
                                 compensation::Rotors<compensation::Hinge>(4)};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto corner = static_cast<std::size_t>(airframe.hinge_turns[i]);
    body.hinges[i] = {body.outline.corner(corner), from_degrees(90.0 * airframe.hinge_turns[i])};
    // A mirrored arm of the square lies along the edge before at 180 degrees.
    if (airframe.mirrored[i])
      body.hinges[i] = {body.outline.corner(corner), body.hinges[i].turn + from_degrees(90), true};
  }
  return body;
}

namespace {

/// The middle of the body's outline, where what does not move with an arm has its weight.
compensation::Position middle_of(const compensation::Airframe& airframe) {
  flight::Vehicle body{airframe, {}, {}, {}};
  body.build.mass_kg = 1;
  const Eigen::Vector2d middle = flight::mass_properties(body, {}, {}).cog;
  return {Metres(middle.x()), Metres(middle.y())};
}

}  // namespace

std::optional<FlownVehicle> flown_vehicle(const compensation::Coefficients& file, const ExportOptions& options) {
  if (options.vehicle == nullptr) return std::nullopt;
  require_curve(file, "a vehicle that morphs");
  const profiles::Vehicle& vehicle = *options.vehicle;
  if (const auto mismatch =
          compensation::overlap_mismatch(file.curve.overlap(), file.path, vehicle.overlap, vehicle.path))
    throw ConfigurationError(*mismatch);
  if (!vehicle.dynamics || vehicle.shapes.empty())
    throw ConfigurationError(
        fmt::format("{}: no section dynamics, whose masses, spins and torque per thrust the target needs; copy it from "
                    "profiles/foldable_drone.yaml",
                    vehicle.path));
  FlownVehicle flown;
  flown.name = vehicle.name;
  flown.airframe = profiles::airframe_of(vehicle);
  flown.airframe.fastest_speed = RadPerSec(speed_max_of(file, options));
  const std::size_t rotors = compensation::rotors_of(flown.airframe);
  const flight::Build& build = *vehicle.dynamics;
  flown.masses.body = build.mass_kg - static_cast<double>(rotors) * build.hub_mass_kg;
  flown.masses.body_at = middle_of(flown.airframe);
  flown.masses.at_hubs = compensation::Rotors<double>(rotors, build.hub_mass_kg);
  flown.spins = compensation::Rotors<int>(rotors);
  for (std::size_t i = 0; i < rotors; ++i) flown.spins[i] = build.spin[i] > 0 ? 1 : -1;
  const auto measured = torque_per_thrust(file, 0);
  flown.drag_per_newton = measured ? measured->value : build.yaw_arm_m;
  const auto x = vehicle.shapes.find("X");
  const auto& [name, angles] = x != vehicle.shapes.end() ? *x : *vehicle.shapes.begin();
  flown.reference_name = name;
  flown.reference = angles;
  flown.reference_layout = layout_of(flown.airframe, flown.masses, flown.reference, flown.spins);
  const auto built = compensation::Compensator::build(
      compensation::Rotors<compensation::ThrustCurve>(rotors, file.curve), flown.airframe);
  if (!built.compensator) throw ConfigurationError(vehicle.path + ": " + describe(built.refusal));
  if (!compensation::Mixer::build(flown.reference_layout, {Metres(flown.drag_per_newton), 0}))
    throw ConfigurationError(fmt::format("{}: its rotors cannot make every torque in {}; check rotor_spins",
                                         vehicle.path, flown.reference_name));
  return flown;
}

std::string origin_words(const compensation::Coefficients& file) {
  switch (origin_named(file.origin)) {
    case Origin::measured:
      return "measured";
    case Origin::simulated:
      return "SIMULATED, no propeller turned";
    case Origin::unknown:
      break;
  }
  return "unknown";
}

std::string verdict_words(const compensation::Coefficients& file) {
  const auto readiness = readiness_named(file.verdict);
  if (!readiness) return "unknown";
  const auto& share = file.thrust_error.share_95;
  const std::string where =
      file.thrust_error.where.empty() ? "" : fmt::format(" where {} flies", one_line(file.thrust_error.where));
  return fmt::format("{}{}", words(*readiness),
                     share ? fmt::format(", thrust within {} % (95 %){}", two_digits(100 * *share), where) : "");
}

}  // namespace kphi::fit
