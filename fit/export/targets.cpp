// One function per target. A target without φ gets the coefficient that flies at options.phi_deg.
#include "fit/export/targets.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/device_data.hpp"
#include "base/error.hpp"
#include "base/number.hpp"
#include "fit/export/mcap_writer.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/report/html.hpp"
#include "fit/uncertainty/readiness.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kEndless = std::numeric_limits<double>::infinity();

/// K_T k_i(φ), as it flies (ScalingLaw::clamped), N/(rad/s)². Throws ConfigurationError for a φ beyond the file's.
double coefficient_at(const compensation::Coefficients& file, double phi_deg) {
  if (!(phi_deg >= 0) || phi_deg > to_degrees(file.curve.largest_fitted()) + 1e-9) {
    throw ConfigurationError(fmt::format("{}: --phi-deg {} is outside the measured occlusions, 0 to {:g}", file.path,
                                         phi_deg, to_degrees(file.curve.largest_fitted())));
  }
  return file.curve.thrust_coefficient().value() * file.curve.scaling_factor(from_degrees(phi_deg));
}

/// rad/s at full output: the option, else the file's. Throws ConfigurationError without both.
double speed_max_of(const compensation::Coefficients& file, const ExportOptions& options) {
  if (options.speed_max_rpm) return from_rpm(*options.speed_max_rpm).value();
  if (file.fastest_speed) return file.fastest_speed->value();
  throw ConfigurationError(file.path +
                           ": no range of speeds in the file; give the speed at full output with --speed-max-rpm");
}

/// Torque per thrust, m, with its standard uncertainty.
struct TorquePerThrust {
  double value = 0;
  std::optional<double> u;
};

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
  TorquePerThrust result{k_q / k, std::nullopt};
  if (left.u && right.u && file.thrust_coefficient)
    result.u = result.value * std::hypot(std::max(*left.u, *right.u) / k_q,
                                         file.thrust_coefficient->u / file.curve.thrust_coefficient().value());
  return result;
}

/// "0.01226 ± 0.00009 m (95 %)".
std::string words_of(const TorquePerThrust& torque) {
  return torque.u ? fmt::format("{:.4g} ± {:.2g} m (95 %)", torque.value, coverage_factor(kEndless, 0.95) * *torque.u)
                  : fmt::format("{:.4g} m", torque.value);
}

/// Throws ConfigurationError unless there is one direction for each motor, or none at all.
void require_turns(const ExportOptions& options) {
  if (options.turns.empty() || options.turns.size() == static_cast<std::size_t>(options.motors)) return;
  throw ConfigurationError(fmt::format("--turns names {} motors, but there are {}; name each, or set --motors",
                                       options.turns.size(), options.motors));
}

constexpr const char* kNoTorque = "torque: the coefficient file has none; measure it with the load cell's torque axis";

/// Control characters become blanks.
std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, ' ');
  return text;
}

/// "± 2.1e-09 (95 %, GUM; without calibration, which is unknown)".
std::string uncertainty_words(const compensation::Coefficients& file) {
  if (!file.thrust_coefficient) return "uncertainty unknown";
  std::string more;
  if (!file.assumed.empty()) more += fmt::format("; assumed in it: {}", fmt::join(file.assumed, ", "));
  if (!file.not_known.empty()) more += fmt::format("; unknown and not in it: {}", fmt::join(file.not_known, ", "));
  return fmt::format("± {:.2g} (95 %, GUM{})", file.thrust_coefficient->expanded_95, one_line(more));
}

bool is_simulated(const compensation::Coefficients& file) { return origin_named(file.origin) == Origin::simulated; }

/// "5x3, Cyclone T5040C; 1.23e-06 N/(rad/s)^2 at phi = 0 deg; measured …, fitted by kphi …; 15 runs", one line each.
std::vector<std::string> provenance_lines(const compensation::Coefficients& file) {
  const auto known = [](const std::string& text) { return text.empty() ? std::string("unknown") : one_line(text); };
  return {fmt::format("propeller {}, {}", known(file.propeller.id), known(file.propeller.name)),
          fmt::format("K_T {} N/(rad/s)^2, {}", yaml_number(file.curve.thrust_coefficient().value()),
                      uncertainty_words(file)),
          fmt::format("phi is meant as the {} of the overlap", compensation::name_of(file.curve.overlap())),
          fmt::format("origin: {}; verdict: {}", origin_words(file), verdict_words(file)),
          fmt::format("{} {}, campaign {}, {} runs, fitted by kphi {}", is_simulated(file) ? "simulated" : "measured",
                      known(file.measured_utc), known(file.provenance.campaign), file.provenance.runs.size(),
                      known(file.tool_version)),
          file.air_density_kg_m3 ? fmt::format("in air of {:.4g} kg/m3; k scales with density", *file.air_density_kg_m3)
                                 : "air density unknown; k holds for the air of that day"};
}

/// Those lines, each behind `mark`.
std::string comment(const compensation::Coefficients& file, const std::string& mark) {
  std::string text;
  for (const std::string& line : provenance_lines(file)) text += mark + line + "\n";
  return text;
}

/// A double-quoted scalar that YAML and JSON read alike.
std::string json_text(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Why a target with one constant loses k(φ).
std::string no_phi(const char* target, double phi_deg) {
  return fmt::format(
      "k(phi): {} has one constant per motor and cannot change it in flight; this one is for phi = {:g} deg, use the "
      "compensation library for the others",
      target, phi_deg);
}

/// Two hyphens end an XML comment.
std::string xml_comment_safe(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) text[at + 1] = ' ';
  if (!text.empty() && text.back() == '-') text += ' ';
  return html_escaped(text);
}

struct Parameters {
  std::string text, unknown;

  void add(const std::string& key, const std::string& value) { text += "      " + key + ": " + value + "\n"; }
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

std::string identifier(const std::string& id) {
  std::string name = "kphi_";
  for (const char c : id) name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
}

/// A backslash at the end of a comment's line would take in the next.
std::string cpp_comment_safe(std::string text) {
  std::ranges::replace(text, '\\', '/');
  return text;
}

constexpr const char* kHeaderLine = R"(
/// k on the line, N/(rad/s)^2; phi in rad. Beyond kLargestPhi it is an extrapolation and may be negative.
constexpr double coefficient_at(double phi) { return kIntercept + kSlope * phi; }
)";

constexpr const char* kHeaderTable = R"(
constexpr int kKnots = {0};
constexpr double kKnotPhi[kKnots] = {{{1}}};  ///< rad
constexpr double kKnotCoefficient[kKnots] = {{{2}}};  ///< N/(rad/s)^2

/// k, N/(rad/s)^2, straight between the knots; phi in rad. Beyond kLargestPhi it is an extrapolation.
constexpr double coefficient_at(double phi, int i = 0) {{
  return i + 2 < kKnots && phi >= kKnotPhi[i + 1]
             ? coefficient_at(phi, i + 1)
             : kKnotCoefficient[i] + (kKnotCoefficient[i + 1] - kKnotCoefficient[i]) /
                                         (kKnotPhi[i + 1] - kKnotPhi[i]) * (phi - kKnotPhi[i]);
}}
)";

constexpr const char* kHeaderFunctions = R"(
/// k_i in [0.1, 1]: 1 without occlusion (and for a NaN), never a slower propeller, never a diverging one.
constexpr double scaling_factor(double phi) {
  return !(phi > 0) ? 1.0
         : !(coefficient_at(phi) < kThrustCoefficient) ? 1.0
         : coefficient_at(phi) < 0.1 * kThrustCoefficient ? 0.1
                                                          : coefficient_at(phi) / kThrustCoefficient;
}

/// The square of the speed [rad^2/s^2] that gives `thrust` [N] with occlusion `phi` [rad]: equation 4, squared.
constexpr double squared_speed(double thrust, double phi) {
  return thrust / (kThrustCoefficient * scaling_factor(phi));
}
)";

/// Nothing if k does not change with the speed.
void say_trend(const compensation::Coefficients& file, Export& result) {
  const auto& [per_rad_s, reference] = file.curve.speed_trend();
  if (per_rad_s == 0) return;
  result.lost.push_back(fmt::format("change of k with the speed: {:+.2g} % each 1000 RPM; k is that of {:.0f} RPM",
                                    100 * per_rad_s * from_rpm(1000).value(), to_rpm(reference)));
}

std::string error_at(const compensation::ThrustCurve& curve, Radians phi) {
  const double error = curve.standard_error_at(phi);
  return std::isfinite(error) ? shortest(error) : "";
}

constexpr const char* kCoefficientSchema =
    R"({"type":"object","properties":{"phi_deg":{"type":"number"},"k":{"type":"number"},"u":{"type":"number"},"expanded_95":{"type":"number"},)"
    R"("curve_k":{"type":"number"},"scaling_factor":{"type":"number"}}})";

std::map<std::string, std::string> provenance(const compensation::Coefficients& file) {
  std::map<std::string, std::string> values{{"propeller", file.propeller.id},
                                            {"k_unit", "N/(rad/s)^2"},
                                            {"K_T", Json(file.curve.thrust_coefficient().value()).dump()},
                                            {"origin", name_of(origin_named(file.origin))},
                                            {"verdict", file.verdict},
                                            {"measured_utc", file.measured_utc},
                                            {"tool_version", file.tool_version}};
  for (const auto& parameter : file.parameters) values[parameter.key] = Json(parameter.value).dump();
  for (const auto& run : file.provenance.runs) values["sha256 " + run.file] = run.sha256;
  return values;
}

}  // namespace

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
  return fmt::format("{}{}", words(*readiness),
                     share ? fmt::format(", thrust within {} % (95 %)", two_digits(100 * *share)) : "");
}

std::vector<Turn> parse_turns(const std::string& text) {
  std::vector<Turn> turns;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    if (word != "ccw" && word != "cw")
      throw ConfigurationError(
          fmt::format("--turns {}: \"{}\" is neither cw nor ccw; name each motor, such as ccw,ccw,cw,cw", text, word));
    turns.push_back(word == "cw" ? Turn::clockwise : Turn::counter_clockwise);
  }
  return turns;
}

/// T = c2 ω² + c1 ω + c0, ω in rad/s: `thrust_map: [c2, c1, c0]` of a quadrotor file.
Export to_agilicious(const compensation::Coefficients& file, const ExportOptions& options) {
  Export result;
  result.text = comment(file, "# ") +
                fmt::format("# phi = {:g} deg; c2 N/(rad/s)^2, c1 N/(rad/s), c0 N\nthrust_map: [{}, 0.0, 0.0]\n",
                            options.phi_deg, yaml_number(coefficient_at(file, options.phi_deg)));
  if (options.speed_max_rpm || file.fastest_speed)
    result.text += fmt::format("motor_omega_max: {}  # rad/s\n", yaml_number(speed_max_of(file, options)));
  const auto kappa = torque_per_thrust(file, options.phi_deg);
  if (kappa)
    result.text += fmt::format("kappa: {}  # torque per thrust, {}\n", yaml_number(kappa->value), words_of(*kappa));
  if (file.slowest_speed)
    result.text +=
        fmt::format("motor_omega_min: {}  # rad/s, the slowest measured\n", yaml_number(file.slowest_speed->value()));
  result.lost = {no_phi("thrust_map", options.phi_deg),
                 "uncertainties, air density: the file has no keys for them; see its comments"};
  if (!kappa) result.lost.emplace_back(kNoTorque);
  say_trend(file, result);
  return result;
}

/// Parameters as QGroundControl loads them. Control allocation takes thrust = CT u², u the normalised output, so that
/// CT = k ω_max² in N where the output is proportional to speed (a speed-controlled motor); THR_MDL_FAC = 1 says so.
/// Torque = KM · thrust, KM in m, negative for a rotor that turns clockwise: a wrong sign would crash the vehicle, so
/// it is written only where the directions are known.
Export to_px4(const compensation::Coefficients& file, const ExportOptions& options) {
  constexpr double kLargestCt = 100;  // module.yaml of control_allocator
  constexpr int kReal32 = 9;          // MAV_PARAM_TYPE_REAL32
  const double speed_max = speed_max_of(file, options);
  const double ct = coefficient_at(file, options.phi_deg) * speed_max * speed_max;
  if (!(ct <= kLargestCt)) {
    throw ConfigurationError(
        fmt::format("{}: {:.1f} N at full output is above 100, the largest CA_ROTORn_CT; no file", file.path, ct));
  }
  require_turns(options);
  Export result;
  result.text = comment(file, "# ") +
                fmt::format(
                    "# phi = {:g} deg; CT in N at {:.0f} RPM, thrust = CT u^2 with u proportional to speed\n"
                    "# Vehicle-Id Component-Id Name Value Type\n",
                    options.phi_deg, to_rpm(RadPerSec(speed_max)));
  for (int motor = 0; motor < options.motors; ++motor)
    result.text += fmt::format("1\t1\tCA_ROTOR{}_CT\t{}\t{}\n", motor, shortest(ct), kReal32);
  const auto moment = torque_per_thrust(file, options.phi_deg);
  for (std::size_t motor = 0; moment && motor < options.turns.size(); ++motor)
    result.text +=
        fmt::format("1\t1\tCA_ROTOR{}_KM\t{}\t{}\n", motor,
                    shortest(options.turns[motor] == Turn::clockwise ? -moment->value : moment->value), kReal32);
  result.text += fmt::format("1\t1\tTHR_MDL_FAC\t1.0\t{}\n", kReal32);
  result.lost = {no_phi("CA_ROTORn_CT", options.phi_deg),
                 "rad/s: PX4 has only a normalised output; CT is for the speed at full output named above",
                 "uncertainties: PX4 has no such parameters; see its comments"};
  if (!moment) result.lost.emplace_back(kNoTorque);
  if (moment && options.turns.empty())
    result.lost.push_back(
        fmt::format("CA_ROTORn_KM: {}, negative for a rotor that turns clockwise; name the "
                    "directions with --turns ccw,ccw,cw,cw to have it written",
                    words_of(*moment)));
  say_trend(file, result);
  return result;
}

/// SDF for gz-sim's MulticopterMotorModel: motorConstant in N/(rad/s)², momentConstant (torque per thrust) in m,
/// maxRotVelocity in rad/s. RotorS' motorConstant and momentConstant are the same numbers.
Export to_gazebo(const compensation::Coefficients& file, const ExportOptions& options) {
  require_turns(options);
  const double k = coefficient_at(file, options.phi_deg);
  const auto moment = torque_per_thrust(file, options.phi_deg);
  Export result;
  result.text = "<?xml version=\"1.0\"?>\n<sdf version=\"1.9\">\n";
  for (const std::string& line : provenance_lines(file)) result.text += "  <!-- " + xml_comment_safe(line) + " -->\n";
  result.text += fmt::format("  <!-- phi = {:g} deg; motorConstant in N/(rad/s)^2, maxRotVelocity in rad/s -->\n",
                             options.phi_deg);
  if (moment) result.text += fmt::format("  <!-- momentConstant, torque per thrust: {} -->\n", words_of(*moment));
  result.text += fmt::format("  <model name=\"{}\">\n", html_escaped(one_line(file.propeller.id)));
  for (int motor = 0; motor < options.motors; ++motor) {
    result.text += fmt::format(
        "    <plugin filename=\"gz-sim-multicopter-motor-model-system\" "
        "name=\"gz::sim::systems::MulticopterMotorModel\">\n"
        "      <jointName>rotor_{0}_joint</jointName>\n      <linkName>rotor_{0}</linkName>\n"
        "      <motorNumber>{0}</motorNumber>\n      <motorType>velocity</motorType>\n"
        "      <motorConstant>{1}</motorConstant>\n      <maxRotVelocity>{2}</maxRotVelocity>\n",
        motor, shortest(k), shortest(speed_max_of(file, options)));
    if (moment) result.text += fmt::format("      <momentConstant>{}</momentConstant>\n", shortest(moment->value));
    if (!options.turns.empty())
      result.text += fmt::format("      <turningDirection>{}</turningDirection>\n",
                                 options.turns[static_cast<std::size_t>(motor)] == Turn::clockwise ? "cw" : "ccw");
    result.text += "    </plugin>\n";
  }
  result.text += "  </model>\n</sdf>\n";
  result.lost = {
      no_phi("MulticopterMotorModel", options.phi_deg),
      "time constants: not in the coefficient file; timeConstantUp and timeConstantDown keep the plugin's defaults",
      "names of joints and links: rotor_N; replace them with the model's"};
  if (!moment) result.lost.emplace_back(kNoTorque);
  if (options.turns.empty())
    result.lost.emplace_back("turning directions: the plugin's default; name them with --turns ccw,ccw,cw,cw");
  say_trend(file, result);
  return result;
}

/// A parameter file for any node. Arrays are of one type, and a double must look like one (45.0, not 45).
Export to_ros2(const compensation::Coefficients& file, const ExportOptions&) {
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
  file.curve.visit(
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
  if (const auto& trend = file.curve.speed_trend(); trend.per_rad_s != 0) {
    parameters.number("speed_trend_s_per_rad", trend.per_rad_s);
    parameters.number("speed_trend_reference_rad_s", trend.reference.value());
  }
  parameters.number("phi_max_rad", file.curve.largest_fitted().value());
  parameters.number("speed_min_rad_s", value_of(file.slowest_speed));
  parameters.number("speed_max_rad_s", value_of(file.fastest_speed));
  parameters.number("air_density_kg_m3", file.air_density_kg_m3);
  add_table(file, parameters);
  Export result;
  result.text = comment(file, "# ") + "/**:\n  ros__parameters:\n    kphi:\n" + parameters.text;
  result.lost = {
      "hashes of the runs: only in the coefficient file",
      "the covariance's shape: parameters have no matrices; it is row by row, in the order of the parameters"};
  if (!parameters.unknown.empty())
    result.lost.push_back("unknown values: parameters have no null; left out: " + parameters.unknown);
  return result;
}

/// A constexpr header for flight controllers without YAML: C++14, includes nothing, the law of ScalingLaw::clamped.
Export to_header(const compensation::Coefficients& file, const ExportOptions&) {
  Export result;
  for (const std::string& line : provenance_lines(file)) result.text += "// " + cpp_comment_safe(line) + "\n";
  result.text += fmt::format("#pragma once\n\nnamespace {} {{\n\n", identifier(file.propeller.id));
  const auto constant = [&](const char* name, double value, const char* what) {
    result.text += fmt::format("constexpr double {} = {};  ///< {}\n", name, yaml_number(value), what);
  };
  result.text += fmt::format("constexpr bool kSimulated = {};  ///< not by devices\n", is_simulated(file));
  result.text += fmt::format("constexpr const char* kVerdict = {};\n", json_text(verdict_words(file)));
  constant("kThrustCoefficient", file.curve.thrust_coefficient().value(), "K_T, N/(rad/s)^2");
  if (file.thrust_coefficient)
    constant("kThrustCoefficientExpanded95", file.thrust_coefficient->expanded_95, "half of its 95 % interval (GUM)");
  constant("kLargestPhi", file.curve.largest_fitted().value(), "rad, the largest occlusion measured");
  if (file.fastest_speed) constant("kFastestSpeed", file.fastest_speed->value(), "rad/s, the fastest measured");
  file.curve.visit(
      [&](const compensation::Line& line) {
        constant("kIntercept", line.intercept.value(), "of the line, N/(rad/s)^2");
        constant("kSlope", line.slope_per_rad, "of the line, N/(rad/s)^2 per rad");
        result.text += kHeaderLine;
      },
      [&](const compensation::OcclusionTable& table) {
        std::vector<std::string> phi, k;
        for (const compensation::Knot& knot : table) {
          phi.push_back(yaml_number(knot.occlusion.value()));
          k.push_back(yaml_number(knot.value));
        }
        result.text += fmt::format(kHeaderTable, phi.size(), fmt::join(phi, ", "), fmt::join(k, ", "));
      });
  result.text += kHeaderFunctions;
  result.text += fmt::format("\n}}  // namespace {}\n", identifier(file.propeller.id));
  result.lost = {
      "the measured k per occlusion, covariance, hashes of the runs: the header is for the flight, which only needs "
      "k(phi)"};
  say_trend(file, result);
  return result;
}

/// The table per occlusion with the curve beside it. phi_deg, k and u come first: `kphi fit` reads them; u are standard
/// uncertainties.
Export to_csv(const compensation::Coefficients& file, const ExportOptions&) {
  const compensation::ThrustCurve& curve = file.curve;
  Export result;
  result.text =
      "phi_deg,k_n_s2_per_rad2,u_k_n_s2_per_rad2,expanded_95_k_n_s2_per_rad2,curve_k_n_s2_per_rad2,"
      "u_curve_k_n_s2_per_rad2,scaling_factor,origin,verdict\n";
  for (const auto& row : file.table) {
    result.text += fmt::format(
        "{},{},{},{},{},{},{},{},{}\n", shortest(std::round(to_degrees(row.occlusion) * 1e9) / 1e9),
        shortest(row.k.value()), row.uncertainty ? shortest(row.uncertainty->u) : "",
        row.uncertainty ? shortest(row.uncertainty->expanded_95) : "", shortest(curve.at(row.occlusion).value()),
        error_at(curve, row.occlusion), shortest(curve.scaling_factor(row.occlusion)),
        name_of(origin_named(file.origin)), file.verdict.empty() ? "unknown" : file.verdict);
  }
  result.lost = {"the curve's parameters, covariance, validity, hashes of the runs: only in the coefficient file"};
  return result;
}

/// One message per occlusion, a second apart: Foxglove and PlotJuggler plot over time only.
Export to_mcap(const compensation::Coefficients& file, const ExportOptions&) {
  std::ostringstream bytes;
  McapWriter writer(bytes, "kphi " + file.tool_version);
  const auto channel =
      writer.add_channel("/kphi/coefficient", "kphi.Coefficient", kCoefficientSchema, {{"k_unit", "N/(rad/s)^2"}});
  std::uint64_t time_ns = 0;
  for (const auto& row : file.table) {
    Json message{{"phi_deg", to_degrees(row.occlusion)}, {"k", row.k.value()}};
    if (row.uncertainty) message.update({{"u", row.uncertainty->u}, {"expanded_95", row.uncertainty->expanded_95}});
    message["curve_k"] = file.curve.at(row.occlusion).value();
    message["scaling_factor"] = file.curve.scaling_factor(row.occlusion);
    writer.write(channel, time_ns, message.dump());
    time_ns += 1'000'000'000;
  }
  writer.add_metadata("kphi-coefficients", provenance(file));
  writer.close();
  return {std::move(bytes).str(), {"phi as an axis: the format only has time; the occlusions are a second apart"}};
}

std::span<const Target> targets() {
  static constexpr std::array<Target, 7> kTargets{{
      {"agilicious", "thrust_map of a quadrotor file (YAML)", to_agilicious},
      {"px4", "CA_ROTORn_CT, THR_MDL_FAC (QGroundControl .params)", to_px4},
      {"gazebo", "gz-sim MulticopterMotorModel (SDF)", to_gazebo},
      {"ros2", "parameter file (YAML)", to_ros2},
      {"header", "constexpr C++ header", to_header},
      {"csv", "table per occlusion, or the samples of a run", to_csv},
      {"mcap", "for Foxglove and PlotJuggler; of a run: every sample", to_mcap},
  }};
  return kTargets;
}

}  // namespace kphi::fit
