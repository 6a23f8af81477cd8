#include "fit/coefficients/coefficients.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/error.hpp"
#include "base/number.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/units.hpp"
#include "results/checksums.hpp"

namespace kphi::fit {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A YAML double-quoted scalar: propeller "5e3" stays text, and no text can end the quotes.
std::string quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// In RPM to a thousandth, which only hides the rounding of π/30.
double printed_rpm(double speed_rad_s) { return std::round(to_rpm(RadPerSec(speed_rad_s)) * 1000) / 1000; }

std::string number(double value) { return std::isfinite(value) ? yaml_number(value) : "unknown"; }

std::string known_if_positive(double value) { return value > 0 ? yaml_number(value) : "unknown"; }

std::string list(const std::vector<double>& values) {
  std::vector<std::string> numbers;
  for (const double value : values) numbers.push_back(number(value));
  return fmt::format("[{}]", fmt::join(numbers, ", "));
}

std::string matrix(const std::vector<std::vector<double>>& rows) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!std::isfinite(rows[i][i])) return "unknown";
    lines.push_back(list(rows[i]));
  }
  return fmt::format("[{}]", fmt::join(lines, ", "));
}

std::string speed_range(double min_rad_s, double max_rad_s) {
  return list({printed_rpm(min_rad_s), printed_rpm(max_rad_s)});
}

std::string head(const Identification& identification, const Provenance& provenance) {
  const std::string blades = identification.blades > 0 ? fmt::format("{}", identification.blades) : "unknown";
  return fmt::format(
      "format: {}\n"
      "origin: {}\n"
      "measured_utc: {}\n"
      "tool_version: {}\n"
      "propeller: {{id: {}, name: {}, diameter_in: {}, blades: {}}}\n"
      "k_unit: N/(rad/s)^2\n"
      "overlap: {}\n",
      compensation::kCoefficientFormat, name_of(provenance.origin),
      provenance.measured_utc.empty() ? "unknown" : quoted(provenance.measured_utc), quoted(provenance.tool_version),
      quoted(identification.propeller),
      quoted(provenance.propeller_name.empty() ? identification.propeller : provenance.propeller_name),
      known_if_positive(identification.diameter_in), blades, compensation::name_of(identification.options.overlap));
}

/// As keys of a map.
std::string errors(const Budget& budget) {
  return fmt::format("u: {}, freedom: {}, expanded_95: {}", number(budget.combined()),
                     std::isfinite(budget.freedom()) ? number(budget.freedom()) : ".inf", number(budget.expanded()));
}

/// In N/RPM².
std::string in_rpm(const Budget& budget) {
  const auto rpm = [](double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); };
  return with_error(rpm(budget.value), rpm(budget.expanded()));
}

/// A map of value and errors, with the value in the paper's unit as a comment.
std::string entry_of(const Budget& budget, const std::string& more, const std::string& per) {
  return fmt::format("{{value: {}, {}{}}}  # {} N/RPM^2{}\n", yaml_number(budget.value), errors(budget), more,
                     in_rpm(budget), per);
}

std::string curve_block(const Fitted& fitted) {
  const CurveFit& fit = fitted.identification.curve_fit;
  std::vector<double> points;
  for (const CurvePoint& point : fit.points) points.push_back(point.phi_deg);
  std::string text =
      "K_T: " + entry_of(fitted.analysis.coefficients.front(), ", phi_deg: 0.0", "") +
      fmt::format("curve:\n  form: {}\n  anchored: {}\n  points_deg: {}\n",
                  fitted.identification.alone() ? compensation::Coefficients::kNoCurve : name_of(fit.form),
                  fitted.identification.alone() || fit.anchored, list(points));
  bool knots = false;
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const CurveParameter& one = fit.parameters[i];
    const Budget& budget = fitted.analysis.parameters[i];
    if (one.at_deg && !std::exchange(knots, true)) text += "  knots:\n";
    text += one.at_deg ? "    - " + entry_of(budget, ", phi_deg: " + yaml_number(*one.at_deg), "")
                       : "  " + one.key + ": " + entry_of(budget, "", one.per);
  }
  return text;
}

/// Of k with the speed, in shares per 1000 RPM.
std::string trend_block(const Analysis& analysis) {
  if (!analysis.trend) return {};
  const double per_krpm = RadPerSec(from_rpm(1000)).value();
  const auto& [change, reference] = *analysis.trend;
  return fmt::format("speed_trend: {{share_per_1000_rpm: {}, u: {}, reference_rpm: {}}}\n",
                     yaml_number(change.value * per_krpm), yaml_number(change.u * per_krpm),
                     yaml_number(printed_rpm(reference)));
}

std::string valid_block(const Identification& identification) {
  std::vector<std::string> ranges;
  if (!identification.alone()) ranges.push_back("phi_deg: " + list({0, identification.table.back().phi_deg}));
  if (speeds_known(identification))
    ranges.push_back("speed_rpm: " + speed_range(identification.speed_min_rad_s, identification.speed_max_rad_s));
  return fmt::format("valid: {{{}}}\n", fmt::join(ranges, ", "));
}

std::string table_row(const Fitted& fitted, std::size_t i) {
  const OcclusionCoefficient& row = fitted.identification.table[i];
  std::string text = fmt::format("  - {{phi_deg: {}, k: {}, {}", yaml_number(row.phi_deg), yaml_number(row.k),
                                 errors(fitted.analysis.coefficients[i]));
  if (row.at_speed) {
    text += fmt::format(", k_at_speed: {}, at_speed_rpm: {}", yaml_number(row.at_speed->k),
                        yaml_number(printed_rpm(fitted.identification.at_speed_rad_s)));
  }
  if (!fitted.analysis.standard.empty()) {
    const Budget& standard = fitted.analysis.standard[i];
    text += fmt::format(", k_standard: {}, k_standard_u: {}, k_standard_expanded_95: {}", yaml_number(standard.value),
                        number(standard.combined()), number(standard.expanded()));
  }
  if (row.fit) text += fmt::format(", steps: {}, repetitions: {}", row.steps, row.repetitions);
  return text + "}\n";
}

std::string standard_block(const Analysis& analysis) {
  if (analysis.standard.empty()) return "unknown";
  const Budget& K_T = analysis.standard.front();
  return fmt::format("{{value: {}, {}, air_density_kg_m3: {}}}", yaml_number(K_T.value), errors(K_T),
                     yaml_number(kStandardDensity));
}

/// The options in `provenance.fit`, with which the same can be fitted again.
std::string fit_options(const Identification& identification, const std::optional<BenchUncertainty>& bench) {
  std::string text = fmt::format("k_by: {}, weights: {}, loss: {}, curve_loss: {}",
                                 name_of(identification.options.estimator), name_of(identification.options.weighting),
                                 name_of(identification.options.loss), name_of(identification.options.curve.loss));
  if (speeds_known(identification)) {
    text += ", speed_range_rpm: " + speed_range(identification.fitted.min_rad_s, identification.fitted.max_rad_s);
  }
  std::vector<std::string> left_out, known;
  for (const LeftOutRun& run : identification.options.left_out)
    left_out.push_back(quoted(fmt::format("{}:{}:{}", shortest(run.phi_deg), run.repetition, run.cause)));
  if (!left_out.empty()) text += fmt::format(", leave_out: [{}]", fmt::join(left_out, ", "));
  if (identification.options.mounted_once) text += ", mounted_once: true";
  if (!bench) return text;
  for (const auto& [name, value] : known_uncertainties(*bench)) known.push_back(name + ": " + yaml_number(value));
  return text + fmt::format(", u: {{{}}}", fmt::join(known, ", "));
}

std::string provenance_block(const Fitted& fitted, const Provenance& provenance) {
  const Identification& identification = fitted.identification;
  const auto& air = identification.air;
  std::string text = fmt::format(
      "air_density_kg_m3: {}\n"
      "air_density_u_kg_m3: {}\n"
      "k_standard: {}  # K_T in standard air\n"
      "supply_v: {}\n"
      "provenance:\n"
      "  campaign: {}\n"
      "  fit: {{model: {}, estimator: {}, {}}}\n",
      air ? yaml_number(air->value) : "unknown", air ? yaml_number(air->u) : "unknown", standard_block(fitted.analysis),
      number(provenance.supply_v.value_or(kUnknown)), quoted(provenance.campaign),
      quoted(provenance.flight.empty() ? "T = k w^2" : "m f = sum of k(phi) w^2 - drag"),
      quoted(provenance.flight.empty() ? estimator_words(identification) : "least squares over a flight"),
      fit_options(identification, provenance.bench));
  if (const auto& clock = provenance.clock) {
    text += clock->u_gain ? fmt::format("  motor_clock: {{gain: {}, u: {}}}\n", clock->gain, *clock->u_gain)
                          : "  motor_clock: unchecked\n";
  }
  if (!provenance.flight.empty()) text += fmt::format("  flight: {}\n", quoted(provenance.flight));
  if (!provenance.cell_weighed.empty()) text += fmt::format("  cell_weighed: {}\n", quoted(provenance.cell_weighed));
  if (provenance.runs.empty()) return text + "  runs: []\n";
  text += "  runs:\n";
  for (const RunProvenance& run : provenance.runs)
    text += fmt::format("    - {{file: {}, sha256: {}}}\n", quoted(run.file), quoted(run.sha256));
  return text;
}

std::string number_or_none(const std::optional<double>& value) { return value ? number(*value) : "none"; }

/// Rows of φ and of the shares up to it; empty if they are unknown.
std::string error_within(const ThrustErrorWithin& within) {
  if (within.rows.empty()) return {};
  std::vector<double> off;
  for (const double one : within.off_rad_s) off.push_back(printed_rpm(one));
  std::string text = fmt::format(
      "  thrust_error_within:  # the same for phi up to the first number, and speeds as near to reference_rpm\n"
      "    reference_rpm: {}\n    speed_off_rpm: {}\n    rows:\n",
      yaml_number(printed_rpm(within.reference_rad_s)), list(off));
  for (const ThrustErrorWithin::Row& row : within.rows) {
    text += fmt::format("      - [{}", shortest(row.phi_deg));
    for (const double share : row.shares) text += fmt::format(", {:.4f}", share);
    text += "]\n";
  }
  return text;
}

std::string analysis_blocks(const Analysis& analysis) {
  std::string text = "uncertainty:  # by the GUM: u standard, expanded_95 half of the 95 % interval\n";
  text += fmt::format("  covariance: {}  # of K_T and the parameters of the curve, in their order\n",
                      matrix(analysis.covariance));
  text += fmt::format("  not_known: [{}]  # sources missing in the sums\n",
                      fmt::join(analysis.coefficients.front().not_known(), ", "));
  text += fmt::format("  assumed: [{}]  # sources in the sums that nobody measured\n",
                      fmt::join(analysis.coefficients.front().assumed(), ", "));
  const FlightReadiness& flight = analysis.flight;
  text += fmt::format(
      "  thrust_error: {{share_95: {}, phi_deg: {}, fit_to_fly: {}, with_care: {}}}  # of the thrust that flies, where "
      "it is "
      "worst\n",
      number(flight.error.share), number(flight.error.phi_deg), number(flight.limits.fit_to_fly),
      number(flight.limits.with_care));
  text += error_within(flight.error.within);
  std::vector<std::string> doubts;
  for (const Doubt& doubt : flight.doubts) doubts.push_back(quoted(doubt.text));
  text += fmt::format("  verdict: {}\n  doubts: [{}]\n  doubts_allow: {}  # whatever the number\n",
                      name_of(flight.readiness()), fmt::join(doubts, ", "), name_of(flight.by_doubts()));
  text += fmt::format(
      "  curve: {{clipping_deg: {}, zero_deg: {}, k0_minus_K_T: {}, u: {}, lack_of_fit_p: {}, quadratic_p: {}}}\n",
      number_or_none(analysis.shape.clipping_deg), number_or_none(analysis.shape.zero_deg),
      number(analysis.shape.mismatch.value), number(analysis.shape.mismatch.u),
      number(analysis.curvature.lack_of_fit.p), number(analysis.curvature.quadratic.p));
  if (!analysis.speed.empty()) text += "  speed:\n";
  for (const SpeedDependence& one : analysis.speed)
    text += fmt::format("    - {{phi_deg: {}, change_share: {}, u: {}, lack_of_fit_p: {}}}\n", number(one.phi_deg),
                        number(one.change.value), number(one.change.u), number(one.lack_of_fit.p));
  text += fmt::format("  rejected_points: {}\n  outlying_runs: {}  # kept\n", analysis.rejected.size(),
                      analysis.outlying.size());
  if (analysis.torque.empty()) return text;
  text += "torque:  # N m/(rad/s)^2\n";
  for (const TorqueCoefficient& one : analysis.torque)
    text += fmt::format("  - {{phi_deg: {}, k_q: {}, {}, drag_per_thrust_m: {}, drag_per_thrust_expanded_95_m: {}}}\n",
                        number(one.phi_deg), number(one.k_q.value), errors(one.k_q),
                        number(one.drag_per_thrust_m.value), number(expanded(one.drag_per_thrust_m)));
  return text;
}

/// Of the log's supply and speed controller.
std::string throttle_block(const Provenance& provenance) {
  if (provenance.throttle.empty()) return {};
  std::string text = "throttle:  # laws of thrust over throttle of the log; half_95 by the scatter of its rows\n";
  for (const auto& law : provenance.throttle) {
    std::vector<std::string> numbers;
    for (const auto& one : law.numbers)
      numbers.push_back(fmt::format("{{name: {}, value: {}, half_95: {}}}", quoted(one.name), yaml_number(one.value),
                                    yaml_number(one.half_95)));
    text += fmt::format("  - {{law: {}, rms_n: {}, numbers: [{}], not_told_from: [{}]}}\n", law.name,
                        yaml_number(law.rms_n), fmt::join(numbers, ", "), fmt::join(law.not_told_from, ", "));
  }
  return text;
}

/// The value with this name; the first if the file has none.
template <class Enum, std::size_t n>
Enum named(const std::string& name, const char* key, const std::string& path, const std::array<Enum, n>& values) {
  if (name.empty()) return *values.begin();
  for (const Enum value : values)
    if (name == name_of(value)) return value;
  throw ConfigurationError(fmt::format("{}: unknown {} `{}`; fit again with this version of kphi", path, key, name));
}

}  // namespace

std::string estimator_words(const Identification& identification) {
  const bool from_steps = !identification.table.empty() && identification.table.front().fit.has_value();
  const char* const form = identification.options.curve.form == CurveForm::table ? "table" : "weighted line";
  const Loss curve_loss = identification.options.curve.loss;
  const std::string by = curve_loss == Loss::none ? "" : fmt::format(", {} loss", name_of(curve_loss));
  if (!from_steps) return fmt::format("a {} through given k(phi){}", form, by);
  constexpr std::array<const char*, 4> words{
      "least squares of T on w^2 through the origin", "least squares of T on w^2 with an offset",
      "T/w^2 at the reference speed, by least squares of T on w^2, w and 1", "mean T/w^2 at the reference speed"};
  std::string text = words[static_cast<std::size_t>(identification.options.estimator)];
  if (identification.options.weighting != Weighting::equal)
    text += fmt::format(", weighted by {}",
                        identification.options.weighting == Weighting::thrust ? "u(T)" : "u(T) and u(w)");
  if (identification.options.loss != Loss::none) text += fmt::format(", {} loss", name_of(identification.options.loss));
  return identification.alone() ? text : text + fmt::format(", then a {} through k(phi){}", form, by);
}

std::string format_coefficients(const Fitted& fitted, const Provenance& provenance) {
  const Identification& identification = fitted.identification;
  std::string text = head(identification, provenance) + curve_block(fitted) + trend_block(fitted.analysis) +
                     valid_block(identification) + "table:\n";
  for (std::size_t i = 0; i < identification.table.size(); ++i) text += table_row(fitted, i);
  text += provenance_block(fitted, provenance) + analysis_blocks(fitted.analysis) + throttle_block(provenance);
  (void)compensation::parse_coefficients(
      text, "coefficients.yaml",
      compensation::Need::thrust_coefficient);  // what cannot be read again is not written
  return results::sealed(std::move(text));
}

RecordedFit read_recorded_fit(const std::string& path) {
  const auto file = compensation::load_coefficients(path, compensation::Need::thrust_coefficient);
  const auto& fit = file.provenance.fit;
  RecordedFit record;
  IdentificationOptions& options = record.options;
  options.propeller = file.propeller.id;
  options.diameter_in = file.propeller.diameter_in;
  options.blades = file.propeller.blades;
  options.overlap = file.curve.overlap();
  if (!file.alone()) {
    options.curve.form = named(file.form, "form", path, kCurveForms);
    options.curve.anchored = file.anchored;
  }
  for (const Radians& point : file.points) options.curve.points_deg.push_back(to_degrees(point));
  if (!file.table.empty() && file.table.front().at_speed) options.at_speed_rad_s = file.table.front().at_speed->value();
  if (fit.speed_range_rpm) {
    const double slack = 1e-3;  // the file has RPM to a thousandth; with this slack the same steps are taken
    options.speed_range = {from_rpm(fit.speed_range_rpm->first - slack).value(),
                           from_rpm(fit.speed_range_rpm->second + slack).value()};
  }
  options.estimator =
      named(fit.k_by, "k_by", path,
            std::array{Estimator::through_origin, Estimator::with_offset, Estimator::polynomial, Estimator::at_speed});
  options.weighting = named(fit.weights, "weights", path,
                            std::array{Weighting::equal, Weighting::thrust, Weighting::effective_variance});
  options.mounted_once = fit.mounted_once;
  record.limits = {file.thrust_error.fit_to_fly.value_or(record.limits.fit_to_fly),
                   file.thrust_error.with_care.value_or(record.limits.with_care)};
  constexpr std::array kLosses{Loss::none, Loss::huber, Loss::cauchy, Loss::tukey};
  options.loss = named(fit.loss, "loss", path, kLosses);
  options.curve.loss = named(fit.curve_loss, "curve_loss", path, kLosses);
  for (const std::string& run : fit.leave_out) options.left_out.push_back(parse_left_out_run(run));
  if (!fit.bench) return record;
  record.bench.emplace();
  for (const auto& [name, value] : *fit.bench) set_uncertainty(*record.bench, name + "=" + shortest(value));
  options.mounting = record.bench->mounting;
  return record;
}

}  // namespace kphi::fit
