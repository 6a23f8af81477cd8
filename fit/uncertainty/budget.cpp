#include "fit/uncertainty/budget.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
constexpr double kEndless = std::numeric_limits<double>::infinity();
/// Share of a variance that rounding leaves of errors that cancel.
constexpr double kVanishing = 1e-12;

struct Entry {
  const char* name;
  std::optional<double> BenchUncertainty::*member;
  double unit;
  double assumed = kNotKnown;  ///< where nobody measured it, in `unit`
  const char* why = "";        ///< that much
  const char* remedy = "";
};

constexpr std::array<Entry, 6> kEntries{{
    {"calibration", &BenchUncertainty::cell_calibration, 1, 0.006, "slopes of loading and unloading differ by 1 %",
     "weigh the load cell (kphi weigh)"},
    {"cross-axis", &BenchUncertainty::cross_axis, 1, 0.002, "data sheets of six-axis cells, with side loads as large",
     "give it (--u cross-axis=VALUE)"},
    {"alignment-deg", &BenchUncertainty::alignment_rad, kPi / 180, 2, "set up by eye",
     "give it (--u alignment-deg=DEG)"},
    {"clock", &BenchUncertainty::motor_clock, 1, 0.002, "a motor module without a crystal",
     "measure the motor's clock (kphi devices --clock-gain)"},
    {"density", &BenchUncertainty::air_density, 1},
    {"mounting", &BenchUncertainty::mounting, 1, kAssumedMounting, kWhyMounting, kRemount},
}};

/// Of Σ weights · k. Its u is the root mean square over the φ with a weight, the column "u" in a budget of several k.
BudgetRow row_of(const ErrorSource& source, std::span<const double> weights) {
  double sum = 0, squares = 0, spread = 0, u_squares = 0, n = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0) continue;
    const auto& [u, sensitivity, freedom] = source.effects[i];
    const double one = weights[i] * sensitivity * u;
    sum += one;  // signed: common errors add before they are squared
    squares += one * one;
    spread += std::pow(one, 4) / freedom;
    u_squares += u * u;
    ++n;
  }
  BudgetRow row{source.name, source.evaluation, n > 0 ? std::sqrt(u_squares / n) : 0, source.unit};
  if (row.u > 0) row.sensitivity = (source.common ? sum : std::sqrt(squares)) / row.u;
  row.freedom = source.common               ? source.effects.front().freedom
                : source.shared_freedom > 0 ? source.shared_freedom
                : spread > 0                ? squares * squares / spread
                                            : kEndless;
  row.common = source.common;
  row.assumed = source.assumed;
  row.note = source.note;
  row.remedy = source.remedy;
  return row;
}

/// An error common to all measurements of the bench, as `bench` has it, or as assumed. `sensitivity` of k, relative,
/// per its unit at its value.
void add_common(ErrorSources& sources, const char* name, const BenchUncertainty& bench,
                std::optional<double> BenchUncertainty::*member, const char* unit,
                const std::function<double(double)>& sensitivity, const std::string& note = "") {
  const Entry& entry = *std::ranges::find(kEntries, member, &Entry::member);
  const bool known = (bench.*member).has_value();
  const double u = known ? *(bench.*member) : entry.assumed * entry.unit;
  ErrorSource source{name, Evaluation::type_b, unit, known ? note : fmt::format("assumed: {}", entry.why), true, !known,
                     0,    entry.remedy};
  for (const double k : sources.k) source.effects.push_back({u, sensitivity(u) * k});
  sources.sources.push_back(std::move(source));
}

void add_bench(ErrorSources& sources, const BenchUncertainty& bench) {
  const auto as_k = [](double) { return 1.0; };
  add_common(sources, "cell calibration", bench, &BenchUncertainty::cell_calibration, "1", as_k,
             bench.calibration_note);
  add_common(sources, "cross-axis", bench, &BenchUncertainty::cross_axis, "1", as_k);
  // cos α = 1 − α²/2: no first order. The standard deviation of α²/2 is u²/√2.
  add_common(
      sources, "alignment", bench, &BenchUncertainty::alignment_rad, "rad",
      [](double u) { return u / std::numbers::sqrt2; }, "second order");
  add_common(sources, "motor clock", bench, &BenchUncertainty::motor_clock, "1", [](double) { return -2.0; });
}

/// Of plates that were mounted once for all their runs.
ErrorSource mounting_of(const Repeatability& all) {
  ErrorSource mounting{"mounting", Evaluation::type_b, "1",
                       all.mounting_assumed ? fmt::format("assumed, since each occlusion was mounted once for all its "
                                                          "runs: {}",
                                                          kWhyMounting)
                                            : "as given: each occlusion was mounted once for all its runs"};
  mounting.assumed = all.mounting_assumed;
  mounting.remedy = kRemount;
  for (const AngleScatter& angle : all.angles) mounting.effects.push_back({all.mounting.value_or(kNotKnown), angle.k});
  return mounting;
}

void add_repeatability(ErrorSources& sources, const Repeatability& all) {
  ErrorSource noise{"noise within runs", Evaluation::type_a, kUnitOfK};
  ErrorSource between{"repetitions", all.repeated ? Evaluation::type_a : Evaluation::type_b, "1"};
  ErrorSource zero{"zero", Evaluation::type_b, "N",
                   all.zero_beyond.u > 0
                       ? "of each run: as measured and as zeros usually move, and what repetitions add"
                       : "of each run: as measured, and how far zeros usually move in a run"};
  zero.shared_freedom = all.freedom_of_zero();
  between.shared_freedom = all.between.freedom;
  between.assumed = !all.repeated && all.mounting_assumed;
  between.note = all.repeated      ? "beyond noise and zero, pooled over phi"
                 : between.assumed ? fmt::format("assumed, since there is one run each: {}", kWhyMounting)
                                   : "one run each; as given for the mounting";
  noise.remedy = "measure more steps or longer ones";
  between.remedy = all.repeated ? "repeat the campaign once more" : kRemount;
  zero.remedy = "measure the zeros longer, and let the load cell warm up";
  for (const AngleScatter& angle : all.angles) {
    const double runs = static_cast<double>(angle.runs.size());
    noise.effects.push_back({angle.within_u(), 1, angle.within.freedom > 0 ? angle.within.freedom : kEndless});
    between.effects.push_back({all.between.u / std::sqrt(runs), angle.k});
    zero.effects.push_back({std::hypot(angle.zero_u_n, all.zero_beyond.u / std::sqrt(runs)), angle.zero_sensitivity});
  }
  sources.sources.insert(sources.sources.end(), {noise, between, zero});
  if (all.mounted_once) sources.sources.push_back(mounting_of(all));
}

void add_inadequacy(ErrorSources& sources, std::span<const SpeedDependence> speed) {
  ErrorSource source{"model T = k w^2", Evaluation::type_a, kUnitOfK,
                     "where a test finds that k depends on speed: of k at any speed of the range", true};
  for (const SpeedDependence& one : speed)
    source.effects.push_back({one.inadequacy, one.change.value < 0 ? -1.0 : 1.0});
  if (!speed.empty()) sources.sources.push_back(std::move(source));
}

}  // namespace

double BudgetRow::contribution() const { return known() ? std::abs(sensitivity) * u : 0; }

double Budget::combined() const {
  if (std::ranges::none_of(rows, &BudgetRow::known)) return std::numeric_limits<double>::quiet_NaN();
  double squares = 0;
  for (const BudgetRow& row : rows) squares += std::pow(row.contribution(), 2);
  return std::sqrt(squares);
}

double Budget::freedom() const {
  double spread = 0;
  for (const BudgetRow& row : rows) spread += std::pow(row.contribution(), 4) / row.freedom;
  return spread > 0 ? std::pow(combined(), 4) / spread : std::numeric_limits<double>::infinity();
}

double Budget::coverage(double level) const { return coverage_factor(freedom(), level); }

double Budget::expanded(double level) const { return coverage(level) * combined(); }

std::vector<std::string> Budget::not_known() const {
  std::vector<std::string> names;
  for (const BudgetRow& row : rows)
    if (!row.known()) names.push_back(row.source);
  return names;
}

std::vector<std::string> Budget::assumed() const {
  std::vector<std::string> names;
  for (const BudgetRow& row : rows)
    if (row.assumed && share(row) > kVanishing) names.push_back(row.source);
  return names;
}

double Budget::share(const BudgetRow& row) const {
  const double whole = combined();
  return whole > 0 ? std::pow(row.contribution() / whole, 2) : 0;
}

void set_uncertainty(BenchUncertainty& bench, const std::string& text) {
  const std::size_t equals = text.find('=');
  const double value = equals == std::string::npos ? -1 : parse_number(text.substr(equals + 1)).value_or(-1);
  for (const Entry& entry : kEntries) {
    if (text.substr(0, equals) != entry.name || !(value >= 0)) continue;
    bench.*entry.member = value * entry.unit;
    if (entry.member == &BenchUncertainty::cell_calibration) bench.calibration_note.clear();
    return;
  }
  throw ConfigurationError(
      fmt::format("--u {}: expected NAME=VALUE, NAME one of calibration, cross-axis, clock, density, mounting "
                  "(relative: 0.002 is 0.2 %) "
                  "or alignment-deg, VALUE a standard uncertainty, 0 or above",
                  text));
}

std::vector<std::pair<std::string, double>> known_uncertainties(const BenchUncertainty& bench) {
  std::vector<std::pair<std::string, double>> known;
  for (const Entry& entry : kEntries)
    if (const auto& value = bench.*entry.member) known.emplace_back(entry.name, *value / entry.unit);
  return known;
}

Budget ErrorSources::budget(std::string quantity, std::string unit, double value,
                            std::span<const double> weights) const {
  Budget result{std::move(quantity), std::move(unit), value, {}};
  for (const ErrorSource& source : sources) result.rows.push_back(row_of(source, weights));
  return result;
}

double ErrorSources::covariance(std::span<const double> a, std::span<const double> b) const {
  double result = 0;
  for (const ErrorSource& source : sources) {
    double sum_a = 0, sum_b = 0, products = 0;
    for (std::size_t i = 0; i < k.size(); ++i) {
      const auto& [u, sensitivity, freedom] = source.effects[i];
      const double effect = std::isnan(u) ? 0 : sensitivity * u;
      sum_a += a[i] * effect;
      sum_b += b[i] * effect;
      products += a[i] * b[i] * effect * effect;
    }
    result += source.common ? sum_a * sum_b : products;
  }
  return result;
}

ErrorSources error_sources(const Repeatability& repeatability, std::span<const SpeedDependence> speed,
                           const BenchUncertainty& bench) {
  ErrorSources sources;
  for (const AngleScatter& angle : repeatability.angles) sources.k.push_back(angle.k);
  add_repeatability(sources, repeatability);
  add_inadequacy(sources, speed);
  add_bench(sources, bench);
  return sources;
}

ErrorSources error_sources(std::vector<double> k, const std::vector<double>& standard_errors) {
  ErrorSource source{"given standard error", Evaluation::type_b, kUnitOfK};
  for (const double error : standard_errors) source.effects.push_back({error > 0 ? error : kNotKnown, 1});
  return {std::move(k), {std::move(source)}};
}

}  // namespace kphi::fit
