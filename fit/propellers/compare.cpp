#include "fit/propellers/compare.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <utility>

#include "base/error.hpp"
#include "base/json.hpp"
#include "base/number.hpp"
#include "base/statistics.hpp"
#include "base/text.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "fit/model/identification.hpp"
#include "results/campaign_folder.hpp"
#include "results/checksums.hpp"
#include "results/file_layer.hpp"
#include "results/reduction/bin_statistics.hpp"

namespace kphi::fit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char *kUnit = "N/(rad/s)^2", *kTorqueUnit = "N m/(rad/s)^2";

std::string coefficient_name(double phi_deg) { return fmt::format("k({:g}°)", std::round(phi_deg * 1e6) / 1e6); }

std::string torque_name(double phi_deg) { return "k_Q" + coefficient_name(phi_deg).substr(1); }

ComparedResult result_of(const compensation::Coefficients& file, const std::string& name) {
  ComparedResult result;
  result.name = name;
  result.origin = origin_named(file.origin);
  result.propeller = file.propeller.id;
  result.diameter_in = file.propeller.diameter_in;
  if (file.slowest_speed) result.speed_min_rad_s = file.slowest_speed->value();
  if (file.fastest_speed) result.speed_max_rad_s = file.fastest_speed->value();
  if (file.air_density_kg_m3) result.air = Estimate{*file.air_density_kg_m3, file.air_density_u_kg_m3.value_or(0)};
  const auto& curve = file.curve;
  using Uncertainty = compensation::Coefficients::Uncertainty;
  const auto add = [&](const std::string& of, const char* unit, double value, const std::optional<Uncertainty>& known,
                       bool judged = true) {
    const Uncertainty one = known.value_or(Uncertainty{});
    result.estimates.push_back({of, unit, value, one.u, judged, one.freedom});
  };
  add("K_T", kUnit, curve.thrust_coefficient().value(), file.thrust_coefficient);
  for (const auto& row : file.table)
    if (row.occlusion.value() > 0)
      add(coefficient_name(to_degrees(row.occlusion)), kUnit, row.k.value(), row.uncertainty);
  for (const auto& parameter : file.parameters) {
    const std::size_t per = parameter.key.find("_per_deg");
    add(parameter.key.substr(0, per), per == std::string::npos ? kUnit : "N/(rad/s)^2 per degree", parameter.value,
        parameter.uncertainty, false);
  }
  for (const auto& row : file.torque)
    add(torque_name(to_degrees(row.occlusion)), kTorqueUnit, row.k_q, row.uncertainty, false);
  result.file = file;
  return result;
}

bool is_flight(const ComparedResult& result) { return result.file && !result.file->provenance.flight.empty(); }

/// k(φ)/K_T of a file's curve. Of a line by its covariance, in which common errors cancel; of a table as if they did
/// not.
ComparedValue ratio_at(const compensation::Coefficients& file, double phi_deg) {
  const double k_t = file.curve.thrust_coefficient().value(), phi = from_degrees(phi_deg).value();
  ComparedValue ratio{fmt::format("{}/K_T", coefficient_name(phi_deg)), "1", file.curve.at(Radians(phi)).value() / k_t};
  for (const auto& parameter : file.parameters)
    if (parameter.uncertainty) ratio.freedom = std::min(ratio.freedom, parameter.uncertainty->freedom);
  if (file.covariance.empty()) {
    const double u = file.curve.relative_uncertainty(Radians(phi), Radians(0));
    ratio.standard_error = std::isfinite(u) ? u * ratio.value : 0;
    return ratio;
  }
  const std::array<double, 3> slopes{-ratio.value / k_t, 1 / k_t, phi / k_t};
  double variance = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) variance += slopes[i] * slopes[j] * file.covariance[i][j];
  ratio.standard_error = std::sqrt(std::max(0.0, variance));
  return ratio;
}

/// Of a bench and a flight what both can tell; the ratio is judged where it is widest, and shown on the way there.
void at_common_angles(ComparedResult& a, ComparedResult& b) {
  if (is_flight(a) == is_flight(b) || !a.file || !b.file) return;
  const bool curves = !a.file->alone() && !b.file->alone();
  const double widest =
      curves ? to_degrees(std::min(a.file->curve.largest_fitted(), b.file->curve.largest_fitted())) : 0;
  for (ComparedResult* one : {&a, &b}) {
    one->estimates.resize(1);
    for (double phi = 15; phi < widest - 5; phi += 15) {
      one->estimates.push_back(ratio_at(*one->file, phi));
      one->estimates.back().judged = false;
    }
    if (widest > 0) one->estimates.push_back(ratio_at(*one->file, widest));
  }
}

/// What a difference between a bench and a flight usually means.
void remark_flight(Comparison& comparison) {
  if (is_flight(comparison.a) == is_flight(comparison.b) || comparison.verdict != Agreement::differ) return;
  bool level = false, ratio = false;
  for (const Difference& entry : comparison.differences) {
    if (!entry.significant || !entry.judged) continue;
    (entry.name == "K_T" ? level : ratio) = true;
  }
  if (ratio)
    comparison.remarks.emplace_back(
        "k(φ)/K_T differs, although mass, accelerometer and load cell cancel in it: the body of the vehicle disturbs "
        "the "
        "air below it differently from a plate on the stand, an arm angle is wrong, or k(φ) is not a line");
  if (level && !ratio)
    comparison.remarks.emplace_back(
        "K_T differs and k(φ)/K_T does not: one factor in all k; weigh the vehicle with its battery, turn the "
        "accelerometer over for its scale, look at pole count and clock of the speeds, and weigh the load cell");
}

Difference difference(const ComparedValue& a, const ComparedValue& b) {
  Difference result{.name = a.name,
                    .unit = a.unit,
                    .a = a.value,
                    .b = b.value,
                    .difference = b.value - a.value,
                    .judged = a.judged && b.judged};
  if (!(a.standard_error > 0) || !(b.standard_error > 0)) return result;
  const Estimate apart =
      difference(Estimate{b.value, b.standard_error, b.freedom}, Estimate{a.value, a.standard_error, a.freedom});
  result.standard_error = apart.u;
  result.freedom = apart.freedom;
  result.coverage = coverage_factor(apart.freedom, 1 - kTestLevel);
  result.p = student_test(apart, 0).p;
  return result;
}

void judge(std::vector<Difference>& differences) {
  std::vector<double> p;
  for (const Difference& entry : differences)
    if (entry.judged && entry.p) p.push_back(*entry.p);
  const double level = holm_level(p);
  for (Difference& entry : differences) entry.significant = entry.p && *entry.p < (entry.judged ? level : kTestLevel);
}

Agreement verdict_of(const std::vector<Difference>& differences) {
  bool known = false;
  for (const Difference& entry : differences) {
    if (!entry.judged || !entry.p) continue;
    known = true;
    if (entry.significant) return Agreement::differ;
  }
  return known ? Agreement::agree : Agreement::undecided;
}

void remark(Comparison& comparison) {
  const ComparedResult &a = comparison.a, &b = comparison.b;
  const auto say = [&](std::string text) { comparison.remarks.push_back(std::move(text)); };
  if (a.propeller != b.propeller) say(fmt::format("different propellers: {} and {}", a.propeller, b.propeller));
  const auto apart = [](double x, double y) { return std::abs(x - y) > 0.02 * std::max(x, y); };
  if (apart(a.speed_min_rad_s, b.speed_min_rad_s) || apart(a.speed_max_rad_s, b.speed_max_rad_s)) {
    const auto rpm = [](double speed) { return to_rpm(RadPerSec(speed)); };
    say(fmt::format(
        "different speeds: {:.0f} to {:.0f} and {:.0f} to {:.0f} RPM; on real propellers k rises with speed",
        rpm(a.speed_min_rad_s), rpm(a.speed_max_rad_s), rpm(b.speed_min_rad_s), rpm(b.speed_max_rad_s)));
  }
  if (!a.air || !b.air) {
    say("air density unknown: the weather changes k by up to 3 %");
  } else {
    say(fmt::format("compared in standard air, {} kg/m³; measured in {:.4g} and {:.4g} kg/m³", kStandardDensity,
                    a.air->value, b.air->value));
  }
}

/// All k higher by one factor: neither the propeller nor the plates do that.
void remark_common_factor(Comparison& comparison) {
  double weights = 0, sum = 0;
  std::vector<double> shares, errors;
  for (const Difference& entry : comparison.differences) {
    if (!entry.judged || !entry.standard_error) continue;
    shares.push_back(entry.share());
    errors.push_back(*entry.standard_error / std::abs(entry.a));
    weights += 1 / (errors.back() * errors.back());
    sum += shares.back() / (errors.back() * errors.back());
  }
  const bool differ = comparison.verdict == Agreement::differ;
  if (!differ || shares.size() < 3) return;
  const double factor = sum / weights;
  for (std::size_t i = 0; i < shares.size(); ++i)
    if (std::abs(shares[i] - factor) > 2 * errors[i]) return;
  comparison.remarks.push_back(
      fmt::format("every k of B is {} % {} by one factor: look at calibration, mounting, clock and air first, not at "
                  "propeller or plates",
                  two_digits(100 * std::abs(factor)), factor < 0 ? "lower" : "higher"));
}

/// k · 1.225/ρ, with the error of the density.
void to_standard_air(ComparedResult& result) {
  const double scale = kStandardDensity / result.air->value;
  for (ComparedValue& one : result.estimates) {
    if (one.unit == "1") continue;
    const double of_density = one.value * scale * result.air->u / result.air->value;
    one.value *= scale;
    one.standard_error *= scale;
    if (!(one.standard_error > 0)) continue;
    one.freedom =
        results::joint_freedom(one.standard_error, one.freedom, of_density, std::numeric_limits<double>::infinity());
    one.standard_error = std::hypot(one.standard_error, of_density);
  }
}

void remark_missing(Comparison& comparison) {
  const auto only = [&](const ComparedResult& has, const ComparedResult& lacks) {
    std::string names;
    for (const ComparedValue& estimate : has.estimates) {
      const bool there = std::ranges::count(lacks.estimates, estimate.name, &ComparedValue::name) > 0;
      if (!there) names += (names.empty() ? "" : ", ") + estimate.name;
    }
    if (!names.empty()) comparison.remarks.push_back("only in " + has.name + ": " + names);
  };
  only(comparison.a, comparison.b);
  only(comparison.b, comparison.a);
}

std::string probability(const std::optional<double>& p) {
  if (!p) return "?";
  return *p < 1e-4 ? "<0.0001" : fmt::format("{:.4f}", *p);
}

}  // namespace

ComparedResult load_result(const std::string& path) {
  const fs::path file = fs::is_directory(path) ? fs::path(path) / "coefficients.yaml" : fs::path(path);
  const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
  if (fs::exists(folder / "journal.jsonl")) results::require_intact(results::CampaignFolder::open(folder));
  if (!fs::exists(file))
    throw ConfigurationError(fs::exists(folder / "steps.csv")
                                 ? path + ": not fitted yet; run `kphi fit " + path + "` first"
                                 : path +
                                       ": contains neither coefficients.yaml nor steps.csv; run `kphi fit` or name "
                                       "another folder");
  const compensation::Coefficients coefficients =
      compensation::load_coefficients(file.string(), compensation::Need::thrust_coefficient);
  results::require_seal(results::read_text(file), file.string());
  return result_of(coefficients, path);
}

ComparedResult result_of_log(const Fitted& fitted, Origin origin, const std::string& name) {
  const Identification& found = fitted.identification;
  const Budget& K_T = fitted.analysis.coefficients.front();
  ComparedResult result;
  result.name = name;
  result.origin = origin;
  result.propeller = printable(found.propeller);
  result.diameter_in = found.diameter_in;
  result.speed_min_rad_s = found.speed_min_rad_s;
  result.speed_max_rad_s = found.speed_max_rad_s;
  result.air = found.air;
  result.estimates.push_back({"K_T", kUnit, K_T.value, K_T.combined(), true, K_T.freedom()});
  for (const TorqueCoefficient& row : fitted.analysis.torque)
    result.estimates.push_back(
        {torque_name(row.phi_deg), kTorqueUnit, row.k_q.value, row.k_q.combined(), false, row.k_q.freedom()});
  return result;
}

Comparison compare(ComparedResult a, ComparedResult b) {
  Comparison comparison;
  comparison.a = std::move(a);
  comparison.b = std::move(b);
  at_common_angles(comparison.a, comparison.b);
  if (comparison.a.air && comparison.b.air)
    for (ComparedResult* one : {&comparison.a, &comparison.b}) to_standard_air(*one);
  for (const ComparedValue& of_a : comparison.a.estimates) {
    for (const ComparedValue& of_b : comparison.b.estimates)
      if (of_a.name == of_b.name) comparison.differences.push_back(difference(of_a, of_b));
  }
  judge(comparison.differences);
  comparison.verdict = verdict_of(comparison.differences);
  for (const Difference& entry : comparison.differences) {
    if (!entry.judged || !entry.standard_error) continue;
    const double open = (std::abs(entry.difference) + entry.coverage * *entry.standard_error) / std::abs(entry.a);
    comparison.largest_open_share = std::max(comparison.largest_open_share, open);
  }
  const double d_a = comparison.a.diameter_in, d_b = comparison.b.diameter_in;
  if (d_a > 0 && d_b > 0 && d_a != d_b) comparison.diameter_ratio4 = std::pow(d_b / d_a, 4);
  remark(comparison);
  remark_missing(comparison);
  remark_common_factor(comparison);
  remark_flight(comparison);
  return comparison;
}

SideBySide side_by_side(std::vector<ComparedResult> results, const std::string& remark) {
  SideBySide table{std::move(results), 0, 0, {}, {}};
  const bool known = std::ranges::all_of(table.results, [](const ComparedResult& one) { return one.air.has_value(); });
  if (known)
    for (ComparedResult& one : table.results) to_standard_air(one);
  std::vector<double> K_T, p, distances;
  for (const ComparedResult& one : table.results) K_T.push_back(one.estimates.front().value);
  table.median = median(K_T);
  for (const double k : K_T) distances.push_back(std::abs(k - table.median));
  table.spread = 1.4826 * median(distances) / table.median;
  for (const ComparedResult& one : table.results) {
    const ComparedValue& own = one.estimates.front();
    p.push_back(own.standard_error > 0
                    ? student_test(Estimate{own.value, own.standard_error, own.freedom}, table.median).p
                    : 1);
  }
  const double level = holm_level(p);
  for (const double one : p) table.unlike.push_back(one < level);
  table.remarks.push_back(known ? fmt::format("in standard air, {} kg/m³", kStandardDensity)
                                : "air density unknown: the weather changes k by up to 3 %");
  if (!remark.empty()) table.remarks.push_back(remark);
  return table;
}

std::string side_by_side_table(const SideBySide& table) {
  std::string text = fmt::format("K_T in {}\n{:>13} {:>9} {:>9}\n", kUnit, "K_T", "95 %, ±", "/median-1");
  for (std::size_t i = 0; i < table.results.size(); ++i) {
    const ComparedResult& one = table.results[i];
    const ComparedValue& own = one.estimates.front();
    text += fmt::format("{:>13.5e} {:>9} {:>+7.2f} % {} {}\n", own.value,
                        own.standard_error > 0
                            ? fmt::format("{:.1e}", coverage_factor(own.freedom, 1 - kTestLevel) * own.standard_error)
                            : "?",
                        100 * (own.value / table.median - 1), table.unlike[i] ? "*" : " ", one.name);
  }
  text += fmt::format("\nmedian  {:.5e}; the logs scatter by {:.1f} % (robust standard deviation)\n", table.median,
                      100 * table.spread);
  for (const std::string& remark : table.remarks) text += "note  " + remark + "\n";
  const auto unlike = std::ranges::count(table.unlike, true);
  return text + (unlike == 0 ? "chance explains every difference from the median\n"
                             : fmt::format("chance does not explain the {} marked * (5 %, Holm)\n", unlike));
}

std::string side_by_side_json(const SideBySide& table) {
  Json rows = Json::array();
  for (std::size_t i = 0; i < table.results.size(); ++i) {
    const ComparedResult& one = table.results[i];
    const ComparedValue& own = one.estimates.front();
    rows.push_back({{"name", one.name},
                    {"propeller", one.propeller},
                    {"K_T", own.value},
                    {"u", own.standard_error},
                    {"freedom", own.freedom},
                    {"share", own.value / table.median - 1},
                    {"unlike", static_cast<bool>(table.unlike[i])}});
  }
  Json json{{"unit", kUnit}, {"logs", rows}};
  KPHI_JSON_MEMBERS(json, table, median, spread, remarks);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

TruthCheck check_against_truth(const ComparedResult& found, const std::string& truth) {
  struct Limit {
    const char* name;
    double share;
    double value;
  };
  std::vector<Limit> limits;
  try {
    const YAML::Node propeller = YAML::LoadFile(truth)["propellers"][found.propeller];
    limits = {{"K_T", 0.005, propeller["K_T"].as<double>()},
              {"slope", 0.02, propeller["line"]["slope_per_deg"].as<double>()}};
  } catch (const YAML::Exception& error) {
    throw ConfigurationError(
        fmt::format("{}: no true coefficients of propeller \"{}\" ({})", truth, found.propeller, error.what()));
  }
  TruthCheck check{{}, true};
  for (const Limit& limit : limits) {
    const auto one = std::ranges::find(found.estimates, limit.name, &ComparedValue::name);
    if (one == found.estimates.end())
      throw ConfigurationError(fmt::format("{}: no {} to compare with the truth", found.name, limit.name));
    const double share = one->value / limit.value - 1;
    // 95 % of its own ±; what no stand has is not asked for.
    const double told = std::isnan(one->standard_error) ? 0 : coverage_factor(one->freedom) * one->standard_error;
    const double allowed = std::max(limit.share, told / std::abs(limit.value));
    check.text += fmt::format("{:<6} found {:.6e}  true {:.6e} {:<24} {:+.3f} %, {:.2f} % allowed\n", limit.name,
                              one->value, limit.value, one->unit, 100 * share, 100 * allowed);
    check.close = check.close && std::abs(share) <= allowed;
  }
  return check;
}

const char* word(Agreement verdict) {
  constexpr std::array<const char*, 3> words{"agree", "differ", "undecided"};
  return words[static_cast<std::size_t>(verdict)];
}

std::string comparison_table(const Comparison& comparison) {
  const auto line = [](const char* letter, const ComparedResult& result) {
    return fmt::format(
        "{}  {}{}\n", letter, result.name,
        result.origin == Origin::measured ? std::string() : fmt::format(" ({})", name_of(result.origin)));
  };
  std::string text = line("A", comparison.a) + line("B", comparison.b), unit;
  for (const Difference& entry : comparison.differences) {
    // A table for each unit. fmt pads by display width, so that k(45°) keeps its column.
    if (std::exchange(unit, entry.unit) != entry.unit)
      text += fmt::format("\nin {}\n{:<10} {:>13} {:>13} {:>11} {:>9} {:>9} {:>9}\n", unit, "", "A", "B", "B - A",
                          "95 %, ±", "B/A - 1", "p");
    text += fmt::format("{:<10} {:>13.5e} {:>13.5e} {:>+11.2e} {:>9} {:>+7.2f} % {:>9}{}\n", entry.name, entry.a,
                        entry.b, entry.difference,
                        entry.standard_error ? fmt::format("{:.1e}", entry.coverage * *entry.standard_error) : "?",
                        100 * entry.share(), probability(entry.p), entry.significant ? " *" : "");
  }
  text += "\n";
  for (const Difference& entry : comparison.differences) {
    if (comparison.diameter_ratio4 && entry.name == "K_T")
      text +=
          fmt::format("K_T  B/A = {:.3f}; (diameter B/A)^4 = {:.3f}\n", entry.b / entry.a, *comparison.diameter_ratio4);
  }
  for (const std::string& remark : comparison.remarks) text += "note  " + remark + "\n";
  if (comparison.verdict == Agreement::differ)
    return text + "verdict  differ: chance does not explain the differences marked * (5 %, Holm)\n";
  if (comparison.verdict == Agreement::undecided)
    return text + "verdict  undecided: no coefficient has a standard error in both\n";
  return text +
         fmt::format("verdict  agree: chance explains every difference; a difference of up to {:.2f} % is possible\n",
                     100 * comparison.largest_open_share);
}

std::string comparison_json(const Comparison& comparison) {
  const auto maybe = [](const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); };
  Json rows = Json::array();
  for (const Difference& entry : comparison.differences) {
    Json& row =
        rows.emplace_back(Json{{"u", maybe(entry.standard_error)}, {"share", entry.share()}, {"p", maybe(entry.p)}});
    KPHI_JSON_MEMBERS(row, entry, name, unit, a, b, difference, freedom, judged, significant);
  }
  const Json json{{"a", comparison.a.name},
                  {"b", comparison.b.name},
                  {"verdict", word(comparison.verdict)},
                  {"level", kTestLevel},
                  {"largest_open_share", comparison.largest_open_share},
                  {"diameter_ratio4", maybe(comparison.diameter_ratio4)},
                  {"differences", rows},
                  {"remarks", comparison.remarks}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace kphi::fit
