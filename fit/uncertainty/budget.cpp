#include "fit/uncertainty/budget.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

struct Entry {
  const char* name;
  std::optional<double> BenchUncertainty::*member;
  double unit;
};

constexpr std::array<Entry, 6> kEntries{{
    {"calibration", &BenchUncertainty::cell_calibration, 1},
    {"cross-axis", &BenchUncertainty::cross_axis, 1},
    {"alignment-deg", &BenchUncertainty::alignment_rad, kPi / 180},
    {"clock", &BenchUncertainty::motor_clock, 1},
    {"density", &BenchUncertainty::air_density, 1},
    {"mounting", &BenchUncertainty::mounting, 1},
}};

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kEndless = std::numeric_limits<double>::infinity();

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
  row.note = source.note;
  return row;
}

/// A relative error common to all measurements of the bench. k follows it to the power `power`; the user gives it with
/// --u `option`.
void add_common(ErrorSources& sources, const char* name, const char* option, const std::optional<double>& u,
                double power, const char* unit = "1", const char* note = "") {
  const std::string words = u ? note : fmt::format("unknown; give it with --u {}=VALUE", option);
  ErrorSource source{name, Evaluation::type_b, unit, words, true};
  for (const double k : sources.k) source.effects.push_back({u.value_or(kUnknown), power * k});
  sources.sources.push_back(std::move(source));
}

void add_bench(ErrorSources& sources, const BenchUncertainty& bench) {
  add_common(sources, "cell calibration", "calibration", bench.cell_calibration, 1, "1",
             bench.calibration_note.c_str());
  add_common(sources, "cross-axis", "cross-axis", bench.cross_axis, 1);
  // cos α = 1 − α²/2: no first order. The standard deviation of α²/2 is u²/√2.
  add_common(sources, "alignment", "alignment-deg", bench.alignment_rad,
             bench.alignment_rad.value_or(0) / std::numbers::sqrt2, "rad", "second order");
  add_common(sources, "motor clock", "clock", bench.motor_clock, -2);
}

/// Of plates that were mounted once for all their runs.
ErrorSource mounting_of(const Repeatability& all) {
  ErrorSource mounting{"mounting", Evaluation::type_b, "1",
                       all.mounting ? "as given: each occlusion was mounted once for all its runs"
                                    : "unknown: each occlusion was mounted once for all its runs; remount it for each "
                                      "(remount_each_repetition), or give it with --u mounting=VALUE"};
  for (const AngleScatter& angle : all.angles) mounting.effects.push_back({all.mounting.value_or(kUnknown), angle.k});
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
  between.note = all.repeated        ? "beyond noise and zero, pooled over phi"
                 : all.between_known ? "one run each; as given for the mounting"
                                     : "unknown: one run each; repeat, or give it with --u mounting=VALUE";
  for (const AngleScatter& angle : all.angles) {
    const double runs = static_cast<double>(angle.runs.size());
    noise.effects.push_back({angle.within_u(), 1, angle.within.freedom > 0 ? angle.within.freedom : kEndless});
    between.effects.push_back({all.between_known ? all.between.u / std::sqrt(runs) : kUnknown, angle.k});
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
  for (const double error : standard_errors) source.effects.push_back({error > 0 ? error : kUnknown, 1});
  return {std::move(k), {std::move(source)}};
}

}  // namespace kphi::fit
