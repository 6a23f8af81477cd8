#include "fit/flights/flight_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "base/number.hpp"
#include "base/statistics.hpp"
#include "compensation/file/plausibility.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kAirOfLog = 0.005;  // relative: pressure and a temperature inside the flight controller

ErrorSources sources_of(const FlightFit& fit) {
  ErrorSources all;
  all.k.push_back(fit.k_t);
  for (const KeptThrust& one : fit.kept) all.k.push_back(fit.k_t * one.ratio.value);
  for (const FlightErrorSource& one : fit.sources) {
    ErrorSource source{one.name, one.evaluation, kUnitOfK, one.note, true, false, 0, one.remedy};
    for (const double effect : one.of)
      source.effects.push_back({std::abs(effect), effect < 0 ? -1.0 : 1.0, one.freedom});
    if (std::isfinite(one.freedom)) source.shared_freedom = one.freedom;
    all.sources.push_back(std::move(source));
  }
  return all;
}

/// Arms that stay tell no curve.
Identification k_t_alone(const CurvePoint& point, const IdentificationOptions& options) {
  Identification result;
  result.options = options;
  result.propeller = options.propeller;
  result.diameter_in = options.diameter_in;
  result.blades = options.blades;
  result.table.push_back({.phi_deg = 0, .k = point.k, .standard_error = point.standard_error});
  result.curve_fit.K_T = point.k;
  result.curve_fit.K_T_standard_error = point.standard_error;
  result.fitted = options.speed_range;
  result.speed_min_rad_s = options.speed_range.min_rad_s;
  result.speed_max_rad_s = options.speed_range.max_rad_s;
  return result;
}

std::string percent(double share) { return two_digits(100 * std::abs(share)) + " %"; }

std::string excitation_words(const FlownBins& flown, const FlightFit& fit) {
  const Excitation& done = flown.excitation;
  std::string text = fmt::format("collective ± {} about hover", percent(done.collective));
  if (done.widest_deg == 0) return text + ", no rotor over the body";
  return text + fmt::format(", φ to {:.0f}°, folded or unfolded {} times, {:.0f} s folded{}", done.widest_deg,
                            done.folds, done.seconds_folded, fit.alone() ? " (too little to tell k(φ))" : "");
}

/// Sources of K_T that are more than a tenth of the largest.
std::string largest_sources(const FlightFit& fit) {
  std::vector<FlightErrorSource> sorted = fit.sources;
  std::ranges::sort(sorted, std::greater(), [](const auto& one) { return std::abs(one.of.front()); });
  std::string text;
  for (const FlightErrorSource& one : sorted)
    if (std::abs(one.of.front()) > 0.1 * std::abs(sorted.front().of.front()))
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", one.name, percent(one.of.front() / fit.k_t));
  return text;
}

std::string rotor_words(const FlightFit& fit) {
  double u = 0;
  for (const Estimate& one : fit.rotors) u = std::max(u, expanded(one));
  if (fit.weak_rotor) {
    const Estimate& weak = fit.rotors[*fit.weak_rotor];
    return fmt::format("rotor {} gives {} ± {} less than the others: look at its propeller, then at its motor",
                       *fit.weak_rotor + 1, percent(weak.value), percent(expanded(weak)));
  }
  if (fit.rotors_told) return fmt::format("none is weaker than the others by {} or more", percent(0.03 + u));
  return fmt::format(
      "not told apart (± {}): without roll, pitch and yaw a weak rotor looks like a shifted centre of "
      "gravity",
      percent(u));
}

Json json_of(const Estimate& one) {
  return {{"value", one.value},
          {"u", one.u},
          {"freedom", std::isfinite(one.freedom) ? Json(one.freedom) : Json()},
          {"expanded_95", expanded(one)}};
}

std::string left_out_words(const FlownBins& flown) {
  const LeftOutBins& out = flown.left_out;
  const std::pair<std::size_t, const char*> causes[] = {{out.on_ground, "on the ground"},
                                                        {out.near_ground, "near it"},
                                                        {out.arms_turning, "with moving arms"},
                                                        {out.sinking, "sinking fast"},
                                                        {out.folded, "in a shape flown too shortly"},
                                                        {out.unknown, "without all channels"}};
  std::string text;
  for (const auto& [bins, why] : causes)
    if (bins > 0)
      text += fmt::format("{}{:.0f} s {}", text.empty() ? "" : ", ", static_cast<double>(bins) * flown.width_s, why);
  return text.empty() ? "nothing" : text;
}

/// C_T of open propellers at rest as published, with a quarter of room; what is far beyond is refused anyhow.
constexpr double kUsualLeastCt = 0.04, kUsualLargestCt = 0.25;

/// What is wrong with K_T by all that the flight shows, and what it cannot show.
void add_doubts(Analysis& analysis, const Identification& found, const FlownBins& flown, const LoggedVehicle& vehicle,
                const SpeedCheck& speeds) {
  using enum SpeedCheck::Verdict;
  std::vector<Doubt>& doubts = analysis.flight.doubts;
  constexpr std::string_view kOfBench = "measure another occlusion between them";
  for (Doubt& one : doubts)
    if (const std::size_t at = one.text.find(kOfBench); at != std::string::npos)
      one.text.replace(
          at, kOfBench.size(),
          "fly more shapes between them, 3 s and more each in three pieces of the flight, or turn the arms "
          "slower than 5°/s");
  if (speeds.verdict == contradicted) doubts.push_back({Readiness::not_yet, words(speeds)});
  const double density = flown.density.value_or(kStandardDensity), diameter = found.diameter_in * 0.0254;
  const double c_t = analysis.coefficients.front().value * square(2 * kPi) / (density * std::pow(diameter, 4));
  const bool usual = !(found.diameter_in > 0) || (c_t > kUsualLeastCt && c_t < kUsualLargestCt);
  const bool refused = c_t < compensation::kLeastCt || c_t > compensation::kLargestCt;
  if (!usual && !refused)
    doubts.push_back({Readiness::with_care,
                      fmt::format("K_T makes C_T = {:.2g} of a {:.3g}-inch propeller, published ones have 0.05 to 0.2: "
                                  "check mass, pole count and diameter",
                                  c_t, found.diameter_in)});
  const bool counted = flown.drive.commands || speeds.verdict == confirmed;
  const std::string unseen = fmt::format(
      "nothing in this log shows a wrong mass{}: K_T goes with {}; k(φ)/K_T does not; {}",
      counted ? "" : " or pole count", counted ? "it" : "the mass, and with the speeds by their inverse square",
      counted
          ? "weigh the vehicle with its battery (--mass)"
          : "weigh the vehicle with its battery (--mass), count the magnets, log raw acceleration at 500 Hz or more");
  if (counted && vehicle.weighed)
    analysis.remarks.push_back(unseen.substr(0, unseen.rfind(';')));
  else if (speeds.verdict != contradicted)
    doubts.push_back({Readiness::with_care, unseen});
  std::ranges::stable_sort(doubts, std::greater{}, &Doubt::readiness);
}

}  // namespace

Fitted fitted_of(const FlightFit& fit, const FlownBins& flown, const LoggedVehicle& vehicle, const SpeedCheck& speeds,
                 IdentificationOptions options, const ReadinessLimits& limits) {
  AnalysisOptions judged;
  judged.limits = limits;
  judged.sources = sources_of(fit);
  options.curve = {.form = options.curve.form, .anchored = true};
  options.speed_range = {fit.speed_min_rad_s, fit.speed_max_rad_s};
  // The errors of the points are those that differ from φ to φ; what all share is among the sources.
  std::vector<CurvePoint> points{{0, fit.k_t, std::abs(fit.sources.front().of.front())}};
  for (const KeptThrust& one : fit.kept)
    points.push_back({one.phi_deg, fit.k_t * one.ratio.value, fit.k_t * one.ratio.u});
  Identification result = fit.alone() ? k_t_alone(points.front(), options) : identify_table(points, options);
  if (flown.density) {
    judged.bench.air_density = kAirOfLog;
    result.air = Estimate{*flown.density, kAirOfLog * *flown.density};
    for (OcclusionCoefficient& row : result.table) row.air = result.air;
  }
  Analysis analysis = analyse(result, judged);
  add_doubts(analysis, result, flown, vehicle, speeds);
  return {std::move(result), std::move(analysis)};
}

std::string flight_line(const FlightFit& fit, const FlownBins& flown, const LoggedVehicle& vehicle,
                        const std::string& format) {
  return fmt::format("{}, {:.0f} s of {} with {:g} kg{}, {}", format, flown.excitation.seconds, vehicle.name,
                     vehicle.mass_kg, flown.drive.commands ? " by its commands" : "", excitation_words(flown, fit));
}

std::string flight_words(const FlightFit& fit, const FlownBins& flown, const LoggedVehicle& vehicle,
                         const SpeedCheck& speeds) {
  const auto line = [](const char* name, const std::string& text) { return fmt::format("{:<10} {}\n", name, text); };
  std::string text =
      line("flight",
           fmt::format("{:.0f} s of {} with {:g} kg{}; {}", flown.excitation.seconds, vehicle.name, vehicle.mass_kg,
                       flown.drive.commands ? ", by its commands" : "", excitation_words(flown, fit)));
  text += line("left out", left_out_words(flown));
  std::string kept;
  for (const KeptThrust& one : fit.kept)
    kept += fmt::format("{}{:.4f} ± {:.4f} at {:.1f}°", kept.empty() ? "" : ", ", one.ratio.value, expanded(one.ratio),
                        one.phi_deg);
  if (!fit.alone())
    text += line("k(φ)/K_T", kept + ": what a flight tells best, since mass and accelerometer cancel in it");
  text +=
      line("K_T to", fmt::format("{} (95 %), of {}", percent(coverage_factor(fit.k_t_freedom) * fit.k_t_u / fit.k_t),
                                 largest_sources(fit)));
  if (!flown.drive.commands) text += line("speeds", words(speeds));
  text += line("rotors", rotor_words(fit));
  if (fit.lag_s && fit.law)
    text += line("commands", fmt::format("lag {} s, THR_MDL_FAC {}; the speed at full command is that of the vehicle "
                                         "file: K_T is as uncertain as its square",
                                         with_error(fit.lag_s->value, expanded(*fit.lag_s)),
                                         with_error(fit.law->value, expanded(*fit.law))));
  for (const std::string& remark : fit.remarks) text += line("note", remark);
  return text;
}

nlohmann::ordered_json flight_json(const FlightFit& fit, const FlownBins& flown, const SpeedCheck& speeds) {
  const Excitation& done = flown.excitation;
  Json json{{"seconds", done.seconds},
            {"collective_share", done.collective},
            {"widest_phi_deg", done.widest_deg},
            {"folds", done.folds},
            {"seconds_folded", done.seconds_folded},
            {"by_commands", flown.drive.commands},
            {"k_t_u_share", fit.k_t_u / fit.k_t},
            {"noise_m_s2", fit.noise},
            {"shocks", fit.shocks}};
  json["speeds"] = name_of(speeds.verdict);
  json["beats_per_turn"] = speeds.verdict == SpeedCheck::Verdict::not_felt ? Json() : json_of(speeds.beats);
  json["ratio"] = fit.alone() ? Json() : json_of(fit.ratio());
  json["kept"] = Json::array();
  for (const KeptThrust& one : fit.kept) {
    Json& row = json["kept"].emplace_back(json_of(one.ratio));
    row["phi_deg"] = one.phi_deg;
  }
  json["rotors"] = Json::array();
  for (const Estimate& one : fit.rotors) json["rotors"].push_back(json_of(one));
  json["rotors_told"] = fit.rotors_told;
  json["weak_rotor"] = fit.weak_rotor ? Json(*fit.weak_rotor + 1) : Json();
  if (fit.lag_s) json["lag_s"] = json_of(*fit.lag_s);
  if (fit.law) json["thr_mdl_fac"] = json_of(*fit.law);
  json["sources"] = Json::array();
  for (const FlightErrorSource& one : fit.sources)
    json["sources"].push_back({{"name", one.name},
                               {"of_k_t_share", one.of.front() / fit.k_t},
                               {"of_k_wide_share", one.of.back() / (fit.k_t * fit.ratio().value)}});
  json["beside"] = Json::array();
  for (const FlightNuisance& one : fit.nuisances) {
    Json& row = json["beside"].emplace_back(json_of(one.value));
    row["name"] = one.name;
    row["unit"] = one.unit;
    row["told"] = one.told();
  }
  json["remarks"] = fit.remarks;
  return json;
}

}  // namespace kphi::fit
