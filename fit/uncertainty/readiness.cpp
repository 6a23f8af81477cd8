#include "fit/uncertainty/readiness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>

#include "base/number.hpp"
#include "compensation/file/plausibility.hpp"
#include "compensation/units.hpp"
#include "fit/uncertainty/ideal_disk.hpp"

namespace kphi::fit {
namespace {

constexpr std::array<std::string_view, 4> kNames{"fit_to_fly", "with_care", "not_yet", "no_curve"};

/// Less than this share of the thrust no flight notices, however surely a test sees it.
constexpr double kNegligible = 0.001;

/// A run that stands out by less moves the mean of three by less than 0.5 %, and the scatter in the ± has it.
constexpr double kSmallStray = 0.015;
/// Of k from the slowest to the fastest speed: half of that at either end, which the error of the thrust counts anyhow.
constexpr double kSmallTrend = 0.02;

/// A doubt for the case that its test falls.
struct Suspicion {
  double p = 1;
  Doubt doubt;
};

/// The smaller of two tests of one hypothesis, so that both together reject it as rarely as one; NaN if neither could
/// be made.
double of_both(double p, double q) {
  const double least = 2 * std::fmin(p, q);
  return least > 1 ? 1 : least;
}

/// "0.32 %", "15 %": two digits, without a sign.
std::string in_percent(double share) { return two_digits(100 * std::abs(share)) + " %"; }

/// Of the φ whose tests say so most clearly.
std::optional<Suspicion> of_speed(const Identification& identification, const ModelTests& tests) {
  Suspicion clearest;
  double count = 0;
  const auto rpm = [](const SpeedCoefficient& level) { return to_rpm(RadPerSec(level.speed_rad_s)); };
  for (std::size_t i = 0; i < tests.speed.size(); ++i) {
    const SpeedDependence& one = tests.speed[i];
    const double p = of_both(one.lack_of_fit.p, one.trend.p);
    if (std::isnan(p) || one.levels.size() < 2) continue;
    ++count;
    if (!(p < clearest.p) || std::abs(one.change.value) < kSmallTrend) continue;
    clearest.p = p;
    const double change = one.change.value, slowest = one.levels.front().k / identification.table[i].k - 1;
    clearest.doubt.text = fmt::format(
        "k {} with speed, by {} at {}° from {:.0f} to {:.0f} RPM: near {:.0f} RPM the thrust is {} {} than k says; {}",
        change > 0 ? "rises" : "falls", in_percent(change), one.phi_deg, rpm(one.levels.front()),
        rpm(one.levels.back()), rpm(one.levels.front()), in_percent(slowest), slowest < 0 ? "lower" : "higher",
        tests.trend && !identification.alone()
            ? "the flying library follows it (speed_trend); for a stack that cannot, fit the speeds of "
              "your flight alone (--speed-range-rpm)"
            : "fit the speeds of your flight alone (--speed-range-rpm)");
  }
  if (count == 0) return std::nullopt;
  clearest.p = std::min(1.0, count * clearest.p);
  return clearest;
}

std::optional<Suspicion> of_curve(const Identification& identification, const ModelTests& tests) {
  if (identification.alone()) return std::nullopt;
  const CurveFit& fit = identification.curve_fit;
  const HypothesisTest &form = tests.curvature.lack_of_fit, &quadratic = tests.curvature.quadratic;
  const double p = quadratic.name.empty() ? form.p : of_both(form.p, quadratic.p);
  if (std::isnan(p)) return std::nullopt;
  std::size_t worst = 0;
  for (std::size_t i = 0; i < fit.residuals.size(); ++i)
    if (std::abs(fit.residuals[i]) > std::abs(fit.residuals[worst])) worst = i;
  const double miss = fit.residuals[worst] / fit.K_T;
  if (std::abs(miss) < kNegligible) return Suspicion{};
  const Repeatability& runs = identification.repeatability;
  return Suspicion{
      p,
      {Readiness::fit_to_fly,
       fmt::format("{}: at {}° the measured k is {} of K_T {} it; expect the same error of thrust in flight, and check "
                   "the plates and their angles{}{}",
                   fit.model().denial(), fit.points[worst].phi_deg, in_percent(miss), miss < 0 ? "below" : "above",
                   runs.mounted_once && runs.mounting_assumed
                       ? " (each was mounted once: a crooked mounting looks the same)"
                       : "",
                   fit.model().remedy())}};
}

std::optional<Suspicion> of_runs(const ModelTests& tests) {
  const auto worst = std::ranges::min_element(
      tests.outlying, [](const OutlyingRun& a, const OutlyingRun& b) { return std::fmin(a.p, 1) < std::fmin(b.p, 1); });
  if (worst == tests.outlying.end() || !(std::abs(worst->share) > kSmallStray)) return Suspicion{};
  if (std::isnan(worst->p)) return std::nullopt;
  return Suspicion{worst->p,
                   {Readiness::fit_to_fly,
                    fmt::format("repetition {} at {}° is {} {} the others: look for a slipped plate or a loose screw, "
                                "then repeat this occlusion, or leave the run out (--leave-out \"{}:{}:CAUSE\")",
                                worst->repetition, worst->phi_deg, in_percent(worst->share),
                                worst->share < 0 ? "below" : "above", worst->phi_deg, worst->repetition)}};
}

/// k that rises from one occlusion to the next. Each at its share of the level, one side of the two-sided test; where k
/// falls as it should, none of them can fall by chance, so they take nothing from the other tests.
std::vector<Doubt> of_order(const Identification& identification, const ModelTests& tests) {
  std::vector<Doubt> all;
  const double level = 2 * kTestLevel / static_cast<double>(std::max<std::size_t>(1, tests.differences.size()));
  for (std::size_t i = 0; i < tests.differences.size(); ++i) {
    const OcclusionCoefficient &before = identification.table[i], &after = identification.table[i + 1];
    if (!(after.k > before.k) || !(tests.differences[i].p < level)) continue;
    all.push_back({Readiness::not_yet,
                   fmt::format("k rises by {} from {}° to {}°, but a larger occlusion cannot give more thrust: check "
                               "whether two occlusions were exchanged",
                               in_percent(after.k / before.k - 1), before.phi_deg, after.phi_deg)});
  }
  return all;
}

/// Share by which K_T is low if a plate was left on at 0°: k hardly falls up to the first occlusion, where the
/// occlusions beyond fall by much over as many degrees. 0: it does not look like one.
double plate_at_zero(const Identification& identification, const ModelTests& tests) {
  const auto& table = identification.table;
  if (table.size() < 3 || tests.differences.empty()) return 0;
  const double beyond = (table[1].k - table.back().k) / (table.back().phi_deg - table[1].phi_deg) * table[1].phi_deg;
  const double fall = table[0].k - table[1].k, u = std::abs(fall / tests.differences.front().value);
  const bool can_tell = std::isfinite(u) && beyond > 6 * u;
  return can_tell && fall + 2 * u < beyond / 2 ? (beyond - fall) / table[0].k : 0;
}

std::optional<Doubt> of_untested_curve(const Identification& identification) {
  constexpr std::size_t kLeastRows = 4;
  if (identification.alone() || identification.table.size() >= kLeastRows) return std::nullopt;
  return Doubt{Readiness::with_care,
               fmt::format("k(φ) between the occlusions is not tested: {} measured angles do not tell which way it "
                           "bends; measure another occlusion between them",
                           identification.table.size())};
}

/// What no propeller and no stand does.
std::vector<Doubt> impossible(const Identification& identification) {
  std::vector<double> angles;
  for (const OcclusionCoefficient& row : identification.table) angles.push_back(row.phi_deg);
  const auto air = identification.air ? std::optional(identification.air->value) : std::nullopt;
  std::vector<std::string> texts = compensation::doubts_of(ThrustCoefficient(identification.thrust_coefficient().value),
                                                           identification.diameter_in, air, angles);
  std::ranges::move(broken_laws_of_power(identification), std::back_inserter(texts));
  std::vector<Doubt> doubts;
  for (std::string& text : texts) doubts.push_back({Readiness::not_yet, std::move(text)});
  return doubts;
}

}  // namespace

FlightReadiness flight_readiness(const Identification& identification, const ModelTests& tests,
                                 const ReadinessLimits& limits) {
  FlightReadiness flight{
      .doubts = of_order(identification, tests), .has_curve = !identification.alone(), .limits = limits};
  std::vector<Suspicion> all;
  for (const auto& one : {of_speed(identification, tests), of_curve(identification, tests), of_runs(tests)})
    if (one) all.push_back(*one);
  std::vector<double> p;
  for (const Suspicion& one : all) p.push_back(one.p);
  const double level = holm_level(p);
  for (Suspicion& one : all)
    if (one.p < level) flight.doubts.push_back(std::move(one.doubt));
  if (identification.repeatability.angles.empty() &&
      std::ranges::any_of(identification.table, [](const auto& row) { return !(row.standard_error > 0); }))
    flight.doubts.push_back(
        {Readiness::with_care, "the table gives no u of k: how wrong a k may be is unknown; add its column u_k_…"});
  if (auto doubt = of_untested_curve(identification)) flight.doubts.push_back(std::move(*doubt));
  const double plate = plate_at_zero(identification, tests);
  if (plate > 0)
    flight.doubts.push_back(
        {Readiness::with_care,
         fmt::format("k hardly falls from 0° to {0}°, and by much beyond: if a plate was on at 0°, K_T is {1} too low; "
                     "look, and repeat the runs at 0° (or {0}°, if its plate was missing)",
                     identification.table[1].phi_deg, in_percent(plate))});
  std::ranges::move(impossible(identification), std::back_inserter(flight.doubts));
  std::ranges::stable_sort(flight.doubts, std::greater{}, &Doubt::readiness);
  flight.error = thrust_error(identification,
                              {tests.sources, tests.speed, tests.trend, tests.outlying, tests.air_density_u, plate});
  return flight;
}

Readiness FlightReadiness::by_doubts() const {
  return doubts.empty() ? Readiness::fit_to_fly : doubts.front().readiness;
}

Readiness FlightReadiness::readiness() const {
  const Readiness worst = by_doubts();
  const Readiness by_number = error.share <= limits.fit_to_fly ? Readiness::fit_to_fly
                              : error.share > limits.with_care ? Readiness::not_yet
                                                               : Readiness::with_care;
  if (!has_curve) return worst == Readiness::not_yet ? worst : Readiness::no_curve;
  return std::max(worst, by_number);
}

std::string number_words(const FlightReadiness& flight) {
  const bool impossible = !flight.doubts.empty() && flight.doubts.front().readiness == Readiness::not_yet;
  return (impossible ? "not counting what is said below, " : "") + words(flight.error);
}

std::string verdict_line(const FlightReadiness& flight) {
  return fmt::format("{}: {}", words(flight.readiness()), number_words(flight));
}

const char* words(Readiness readiness) {
  constexpr std::array kWords{"fit to fly", "fly with care", "do not fly yet", "K_T alone, no k(φ) to fly with"};
  return kWords[static_cast<std::size_t>(readiness)];
}

const char* name_of(Readiness readiness) { return kNames[static_cast<std::size_t>(readiness)].data(); }

std::optional<Readiness> readiness_named(const std::string& name) {
  const auto found = std::ranges::find(kNames, name);
  return found == kNames.end() ? std::nullopt : std::optional(static_cast<Readiness>(found - kNames.begin()));
}

}  // namespace kphi::fit
