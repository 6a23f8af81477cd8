#include "fit/flights/flight_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/number.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kAirOfLog = 0.005;  // relative: pressure and a temperature inside the flight controller

ErrorSources sources_of(const FlightFit& fit) {
  ErrorSources all;
  all.k.push_back(fit.k_t);
  if (!fit.alone()) all.k.push_back(fit.k_at(fit.wide_deg));
  for (const FlightErrorSource& one : fit.sources) {
    ErrorSource source{one.name, one.evaluation, kUnitOfK, one.note, true, false, 0, one.remedy};
    for (std::size_t i = 0; i < all.k.size(); ++i) {
      const double effect = i == 0 ? one.of_k_t : one.of_k_wide;
      source.effects.push_back({std::abs(effect), effect < 0 ? -1.0 : 1.0, one.freedom});
    }
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
  std::ranges::sort(sorted, std::greater(), [](const auto& one) { return std::abs(one.of_k_t); });
  std::string text;
  for (const FlightErrorSource& one : sorted)
    if (std::abs(one.of_k_t) > 0.1 * std::abs(sorted.front().of_k_t))
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", one.name, percent(one.of_k_t / fit.k_t));
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
                                                        {out.unknown, "without all channels"}};
  std::string text;
  for (const auto& [bins, why] : causes)
    if (bins > 0)
      text += fmt::format("{}{:.0f} s {}", text.empty() ? "" : ", ", static_cast<double>(bins) * flown.width_s, why);
  return text.empty() ? "nothing" : text;
}

}  // namespace

Fitted fitted_of(const FlightFit& fit, const FlownBins& flown, IdentificationOptions options,
                 const ReadinessLimits& limits) {
  AnalysisOptions judged;
  judged.limits = limits;
  judged.sources = sources_of(fit);
  options.curve = {.form = CurveForm::line, .anchored = true};
  options.speed_range = {fit.speed_min_rad_s, fit.speed_max_rad_s};
  std::vector<CurvePoint> points;
  for (std::size_t i = 0; i < judged.sources->k.size(); ++i) {
    std::vector<double> weights(judged.sources->k.size());
    weights[i] = 1;
    points.push_back({i == 0 ? 0 : fit.wide_deg, judged.sources->k[i],
                      judged.sources->budget("", kUnitOfK, judged.sources->k[i], weights).combined()});
  }
  Identification result = fit.alone() ? k_t_alone(points.front(), options) : identify_table(points, options);
  if (flown.density) {
    judged.bench.air_density = kAirOfLog;
    result.air = Estimate{*flown.density, kAirOfLog * *flown.density};
    for (OcclusionCoefficient& row : result.table) row.air = result.air;
  }
  Analysis analysis = analyse(result, judged);
  return {std::move(result), std::move(analysis)};
}

std::string flight_line(const FlightFit& fit, const FlownBins& flown, const LoggedVehicle& vehicle,
                        const std::string& format) {
  return fmt::format("{}, {:.0f} s of {} with {:g} kg{}, {}", format, flown.excitation.seconds, vehicle.name,
                     vehicle.mass_kg, flown.drive.commands ? " by its commands" : "", excitation_words(flown, fit));
}

std::string flight_words(const FlightFit& fit, const FlownBins& flown, const LoggedVehicle& vehicle) {
  const auto line = [](const char* name, const std::string& text) { return fmt::format("{:<10} {}\n", name, text); };
  std::string text =
      line("flight",
           fmt::format("{:.0f} s of {} with {:g} kg{}; {}", flown.excitation.seconds, vehicle.name, vehicle.mass_kg,
                       flown.drive.commands ? ", by its commands" : "", excitation_words(flown, fit)));
  text += line("left out", left_out_words(flown));
  if (!fit.alone())
    text += line("k(φ)/K_T", fmt::format("{:.4f} ± {:.4f} at {:.1f}°: what a flight tells best, since mass and "
                                         "accelerometer cancel in it",
                                         fit.ratio.value, expanded(fit.ratio), fit.wide_deg));
  text +=
      line("K_T to", fmt::format("{} (95 %), of {}", percent(coverage_factor(fit.k_t_freedom) * fit.k_t_u / fit.k_t),
                                 largest_sources(fit)));
  text += line("rotors", rotor_words(fit));
  if (fit.lag_s && fit.law)
    text += line("commands", fmt::format("lag {} s, THR_MDL_FAC {}; the speed at full command is that of the vehicle "
                                         "file: K_T is as uncertain as its square",
                                         with_error(fit.lag_s->value, expanded(*fit.lag_s)),
                                         with_error(fit.law->value, expanded(*fit.law))));
  for (const std::string& remark : fit.remarks) text += line("note", remark);
  return text;
}

nlohmann::ordered_json flight_json(const FlightFit& fit, const FlownBins& flown) {
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
  json["ratio"] = fit.alone() ? Json() : json_of(fit.ratio);
  json["rotors"] = Json::array();
  for (const Estimate& one : fit.rotors) json["rotors"].push_back(json_of(one));
  json["rotors_told"] = fit.rotors_told;
  json["weak_rotor"] = fit.weak_rotor ? Json(*fit.weak_rotor + 1) : Json();
  if (fit.lag_s) json["lag_s"] = json_of(*fit.lag_s);
  if (fit.law) json["thr_mdl_fac"] = json_of(*fit.law);
  json["sources"] = Json::array();
  for (const FlightErrorSource& one : fit.sources)
    json["sources"].push_back({{"name", one.name},
                               {"of_k_t_share", one.of_k_t / fit.k_t},
                               {"of_k_wide_share", one.of_k_wide / fit.k_at(fit.wide_deg)}});
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
