#include "fit/propellers/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/random/normal_distribution.hpp>
#include <cmath>
#include <ctime>
#include <iomanip>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

#include "base/error.hpp"
#include "base/json.hpp"
#include "base/number.hpp"
#include "base/random.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

/// Of the level: what moves a stand moves all k, so most of it goes there.
constexpr std::array<double, kFollowed.size()> kShares{0.6, 0.2, 0.2};
constexpr double kOutside = 0.0027;  // of what a chart's limits leave out by chance

/// One chart as its tests see it.
struct Series {
  std::vector<double> value, variance;
  double freedom = 0;        ///< behind the variances
  std::vector<double> time;  ///< 0 the first, 1 the last campaign; by their order if a date is not known
};

/// y = mean + size · x, weighted: the size with its standard uncertainty, and the sum of squares left.
struct Step {
  double mean = 0, mean_u = 0, size = 0, size_u = 0, left = 0;
};

/// `x` empty: the mean alone. `between` is added to every variance.
Step fitted(const Series& series, const std::vector<double>& x, double between) {
  double w = 0, wx = 0, wxx = 0, wy = 0, wxy = 0;
  const auto at = [&](std::size_t i) { return x.empty() ? 0 : x[i]; };
  for (std::size_t i = 0; i < series.value.size(); ++i) {
    const double weight = 1 / (series.variance[i] + between);
    w += weight;
    wx += weight * at(i);
    wxx += weight * at(i) * at(i);
    wy += weight * series.value[i];
    wxy += weight * at(i) * series.value[i];
  }
  const double determinant = w * wxx - wx * wx;
  Step step;
  step.size = x.empty() ? 0 : (w * wxy - wx * wy) / determinant;
  step.size_u = x.empty() ? 0 : std::sqrt(w / determinant);
  step.mean = (wy - step.size * wx) / w;
  step.mean_u = std::sqrt(1 / w);
  for (std::size_t i = 0; i < series.value.size(); ++i)
    step.left += std::pow(series.value[i] - step.mean - step.size * at(i), 2) / (series.variance[i] + between);
  return step;
}

/// Variance between campaigns beyond their own (Paule, Mandel, J. Res. NBS 87 (1982) 377): what makes the sum of
/// squares as large as its degrees of freedom; science.md, eq. 32.
double between_of(const Series& series, const std::vector<double>& x, double freedom) {
  if (fitted(series, x, 0).left <= freedom) return 0;
  double low = 0, high = 1e-30;
  while (fitted(series, x, high).left > freedom) high *= 4;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (fitted(series, x, middle).left > freedom ? low : high) = middle;
  }
  return high;
}

struct Hypothesis {
  ChangeKind kind{};
  std::size_t at = 0;
  std::vector<double> x;
};

/// At the ends a shift and a single campaign are the same.
std::vector<Hypothesis> hypotheses(const Series& series) {
  const std::size_t n = series.value.size();
  std::vector<Hypothesis> all;
  for (std::size_t i = 0; i < n; ++i) {
    all.push_back({ChangeKind::one_off, i, std::vector<double>(n)});
    all.back().x[i] = 1;
  }
  for (std::size_t i = 2; i + 2 <= n; ++i) {
    all.push_back({ChangeKind::shift, i, std::vector<double>(n)});
    std::fill(all.back().x.begin() + static_cast<std::ptrdiff_t>(i), all.back().x.end(), 1.0);
  }
  if (series.time.back() > series.time.front()) all.push_back({ChangeKind::drift, 0, series.time});
  return all;
}

/// Degrees of freedom behind own variances and the one between campaigns together (Welch-Satterthwaite).
double freedom_of(const Series& series, double between, double left) {
  double own = 0;
  for (const double variance : series.variance) own += variance / static_cast<double>(series.variance.size());
  return std::pow(own + between, 2) / (own * own / series.freedom + between * between / left);
}

/// Every hypothesis is one more chance to be wrong, but neighbours are alike: to how many independent ones they amount,
/// by noise drawn with the variances of the series.
double chances_of(const std::vector<Hypothesis>& hypotheses, const Series& series) {
  constexpr int kDraws = 4000;
  constexpr double kRare = 0.003;
  const double limit = coverage_factor(std::numeric_limits<double>::infinity(), 1 - kRare);
  SplitMix64 draw(1);
  boost::random::normal_distribution<double> normal;
  Series noise = series;
  int passed = 0;
  for (int i = 0; i < kDraws; ++i) {
    for (std::size_t j = 0; j < noise.value.size(); ++j) noise.value[j] = std::sqrt(series.variance[j]) * normal(draw);
    passed += std::ranges::any_of(hypotheses, [&](const Hypothesis& one) {
      const Step step = fitted(noise, one.x, 0);
      return std::abs(step.size) > limit * step.size_u;
    });
  }
  return std::max(1.0, passed / (kRare * kDraws));
}

/// `share`: of the level of all charts together.
std::optional<Change> change_of(const Series& series, double share) {
  const double left = static_cast<double>(series.value.size()) - 2;
  const std::vector<Hypothesis> all = hypotheses(series);
  const double chances = chances_of(all, series) / share;
  std::optional<Change> best;
  for (const Hypothesis& one : all) {
    const double between = between_of(series, one.x, left);
    const Step step = fitted(series, one.x, between);
    const double p = chances * student_test({step.size, step.size_u, freedom_of(series, between, left)}, 0).p;
    if (p < (best ? best->p : kTestLevel))
      best = Change{one.kind, one.at, step.size / std::abs(step.mean), step.size_u / std::abs(step.mean), p};
  }
  return best;
}

std::optional<double> seconds_of(const std::string& utc) {
  std::tm parts{};
  std::istringstream text(utc);
  text >> std::get_time(&parts, "%Y-%m-%dT%H:%M:%S");
  return text.fail() ? std::nullopt : std::optional<double>(static_cast<double>(::timegm(&parts)));
}

Series series_of(const std::vector<HistoryEntry>& entries, Followed quantity) {
  Series series;
  for (const HistoryEntry& entry : entries) {
    series.value.push_back(entry.of(quantity).value);
    series.variance.push_back(std::pow(entry.of(quantity).u, 2));
    series.freedom += entry.of(quantity).freedom / static_cast<double>(entries.size());
  }
  const auto first = seconds_of(entries.front().when), last = seconds_of(entries.back().when);
  const bool dated = first && last && *last > *first;  // sorted: an unknown date is the first
  for (std::size_t i = 0; i < entries.size(); ++i)
    series.time.push_back(dated ? (seconds_of(entries[i].when).value_or(*first) - *first) / (*last - *first)
                                : static_cast<double>(i) / static_cast<double>(entries.size() - 1));
  return series;
}

Chart chart_of(const std::vector<HistoryEntry>& entries, Followed quantity) {
  const Series series = series_of(entries, quantity);
  Chart chart;
  chart.quantity = quantity;
  chart.freedom = static_cast<double>(entries.size()) - 1;
  chart.change = change_of(series, kShares[static_cast<std::size_t>(quantity)]);
  std::vector<double> x;  // what is named does not widen the limits
  for (std::size_t i = 0; chart.change && chart.change->kind != ChangeKind::drift && i < entries.size(); ++i)
    x.push_back(chart.change->names(i) ? 1 : 0);
  if (!x.empty()) --chart.freedom;
  const double between = between_of(series, x, chart.freedom);
  const Step mean = fitted(series, x, between);
  chart.freedom = freedom_of(series, between, chart.freedom);
  chart.centre = {mean.mean, mean.mean_u, chart.freedom};
  chart.between = std::sqrt(between) / std::abs(mean.mean);
  const double factor = coverage_factor(chart.freedom, 1 - kOutside);
  for (const double variance : series.variance) chart.limits.push_back(factor * std::sqrt(variance + between));
  return chart;
}

/// From run to run, as all campaigns of the stand show it: one alone knows its own scatter by a third at best.
Estimate pooled(std::span<const Fitted> campaigns, Estimate Repeatability::*part) {
  double squares = 0, freedom = 0, n = 0;
  for (const Fitted& one : campaigns) {
    const Estimate& own = one.identification.repeatability.*part;
    if (!one.identification.repeatability.repeated || !std::isfinite(own.freedom)) continue;
    squares += own.u * own.u;
    freedom += own.freedom;
    ++n;
  }
  return {0, n > 0 ? std::sqrt(squares / n) : 0, freedom};
}

/// The errors that are new in each campaign.
class OwnErrors {
 public:
  OwnErrors(const Fitted& one, const Estimate& between, const Estimate& zero_beyond, double scale)
      : one_(one), scale_(scale) {
    Repeatability repeatability = one.identification.repeatability;
    if (between.freedom > 0) {
      repeatability.between = between;
      repeatability.zero_beyond = zero_beyond;
    }
    sources_ = error_sources(repeatability, one.analysis.speed, BenchUncertainty::none());
  }
  [[nodiscard]] Estimate k(std::size_t i) const {
    std::vector<double> weights(one_.identification.table.size());
    weights[i] = 1;
    return of(one_.identification.table[i].k, weights);
  }
  [[nodiscard]] Estimate slope() const {
    const CurveFit line = fit_curve(points_of(one_.identification.table), {});
    const CurveParameter& slope = *line.find("slope_per_deg");
    return of(slope.value, slope.weights);
  }

 private:
  [[nodiscard]] Estimate of(double value, std::span<const double> weights) const {
    Budget budget = sources_.budget("", "", scale_ * value, weights);
    std::erase_if(budget.rows, [](const BudgetRow& row) { return row.common; });
    return {budget.value, scale_ * budget.combined(), budget.freedom()};
  }
  const Fitted& one_;
  double scale_;
  ErrorSources sources_;
};

/// Of every k against its mean over the campaigns, each by its own relative uncertainty.
std::vector<Estimate> stand_factors(const std::vector<std::vector<Estimate>>& tables) {
  std::vector<double> mean(tables.front().size());
  for (const auto& table : tables)
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += table[i].value / static_cast<double>(tables.size());
  std::vector<Estimate> factors;
  for (const auto& table : tables) {
    double weights = 0, sum = 0, freedom = 0;
    for (std::size_t i = 0; i < mean.size(); ++i) {
      freedom += table[i].freedom / static_cast<double>(mean.size());
      const double share = table[i].value / mean[i], u = table[i].u / mean[i];
      weights += 1 / (u * u);
      sum += share / (u * u);
    }
    factors.push_back({sum / weights, 1 / std::sqrt(weights), freedom});
  }
  return factors;
}

std::vector<double> measured_by_all(std::span<const Fitted> campaigns) {
  std::map<double, std::size_t> count;
  for (const Fitted& one : campaigns)
    for (const OcclusionCoefficient& row : one.identification.table) ++count[row.phi_deg];
  std::vector<double> all;
  for (const auto& [phi_deg, times] : count)
    if (times == campaigns.size()) all.push_back(phi_deg);
  return all;
}

void require_one_propeller(std::span<const Fitted> campaigns) {
  if (campaigns.size() < kLeastHistory)
    throw ConfigurationError(
        fmt::format("a history needs {} campaigns or more; there are {}", kLeastHistory, campaigns.size()));
  const std::string& propeller = campaigns.front().identification.propeller;
  if (!of_one_propeller(campaigns))
    throw ConfigurationError("a history is of one propeller, beginning with " + propeller);
  for (const Fitted& one : campaigns)
    if (one.identification.alone())
      throw ConfigurationError(propeller + ": no occlusion was measured; a history needs k(φ)");
}

const char* unit_of(Followed quantity) {
  constexpr std::array<const char*, kFollowed.size()> units{"1", kUnitOfK, "N/(rad/s)^2/deg"};
  return units[static_cast<std::size_t>(quantity)];
}

std::string date_of(const HistoryEntry& entry) { return entry.when.substr(0, 10); }

std::string sentence_of(const History& history, const Chart& chart, const Change& change) {
  const HistoryEntry& entry = history.entries[change.at];
  const std::string size = fmt::format("{:+.2f} ± {:.2f} %", 100 * change.share, 196 * change.u_share);
  const std::string chance = fmt::format("(p = {:.2g})", change.p);
  const char* what = name_of(chart.quantity);
  if (change.kind == ChangeKind::one_off)
    return fmt::format("{}: {} of {} stands {} from the other campaigns {}", what, entry.name, date_of(entry), size,
                       chance);
  if (change.kind == ChangeKind::shift)
    return fmt::format("{}: shifted by {} from {} of {} on {}", what, size, entry.name, date_of(entry), chance);
  return fmt::format("{}: drifts by {} from {} to {} {}", what, size, date_of(history.entries.front()),
                     date_of(history.entries.back()), chance);
}

const char* next_move(Followed quantity) {
  return quantity == Followed::slope ? "look at the plates and how they are mounted"
                                     : "weigh the load cell (kphi weigh), look at mounting, clock and propeller";
}

}  // namespace

const char* name_of(Followed quantity) {
  constexpr std::array<const char*, kFollowed.size()> names{"all k together", "K_T", "slope"};
  return names[static_cast<std::size_t>(quantity)];
}

bool Change::names(std::size_t campaign) const { return kind == ChangeKind::one_off ? at == campaign : campaign >= at; }

bool History::steady() const {
  return std::ranges::none_of(charts, [](const Chart& chart) { return chart.change.has_value(); });
}

bool of_one_propeller(std::span<const Fitted> campaigns) {
  return std::ranges::all_of(campaigns, [&](const Fitted& one) {
    return one.identification.propeller == campaigns.front().identification.propeller;
  });
}

std::vector<Chart> charts_of(std::vector<HistoryEntry>& entries) {
  std::ranges::stable_sort(entries, {}, &HistoryEntry::when);
  std::vector<Chart> charts;
  for (const Followed quantity : kFollowed) charts.push_back(chart_of(entries, quantity));
  return charts;
}

History history_of(std::span<const Fitted> campaigns, std::span<const std::string> names,
                   std::span<const std::string> when) {
  require_one_propeller(campaigns);
  History history;
  history.propeller = campaigns.front().identification.propeller;
  history.air = common_air(campaigns);
  history.occlusions_deg = measured_by_all(campaigns);
  const Estimate between = pooled(campaigns, &Repeatability::between),
                 zero_beyond = pooled(campaigns, &Repeatability::zero_beyond);
  std::vector<std::vector<Estimate>> tables;
  for (std::size_t i = 0; i < campaigns.size(); ++i) {
    const Identification& one = campaigns[i].identification;
    const OwnErrors own(campaigns[i], between, zero_beyond,
                        history.air == Air::standard ? kStandardDensity / one.air->value : 1);
    tables.emplace_back();
    for (std::size_t j = 0; j < one.table.size(); ++j)
      if (std::ranges::count(history.occlusions_deg, one.table[j].phi_deg) > 0) tables.back().push_back(own.k(j));
    history.entries.push_back({names[i], when[i], {Estimate{}, own.k(0), own.slope()}});
  }
  const std::vector<Estimate> factors = stand_factors(tables);
  for (std::size_t i = 0; i < factors.size(); ++i) history.entries[i].values.front() = factors[i];
  history.charts = charts_of(history.entries);
  return history;
}

std::vector<std::string> findings_of(const History& history) {
  std::vector<std::string> sentences;
  // A change of the stand shows in K_T and the slope as well: it is said once.
  for (const Chart& chart : history.charts) {
    if (!chart.change) continue;
    sentences.push_back(sentence_of(history, chart, *chart.change) + "; " + next_move(chart.quantity));
    if (chart.quantity == Followed::stand) break;
  }
  if (sentences.empty())
    sentences.push_back(
        fmt::format("steady: {} campaigns, no shift and no drift beyond chance; they scatter by {} % "
                    "beyond their own uncertainty",
                    history.entries.size(), two_digits(100 * history.charts.front().between)));
  return sentences;
}

std::string history_text(const History& history) {
  std::string text =
      fmt::format("{} over {} campaigns, in {}\n\n{:<11} {:>17} {:>22} {:>23}  {}\n", history.propeller,
                  history.entries.size(), history.air == Air::standard ? "standard air" : "the air of their days",
                  "date (UTC)", "all k together, %", "K_T, N/(rad/s)^2", "slope, N/(rad/s)^2/deg", "folder");
  const auto cell = [&](std::size_t i, Followed quantity, const std::string& value) {
    const Chart& chart = history.charts[static_cast<std::size_t>(quantity)];
    const bool outside = std::abs(history.entries[i].of(quantity).value - chart.centre.value) > chart.limits[i];
    return value + (outside ? "*" : " ");
  };
  const auto expanded = [](const Estimate& one) { return coverage_factor(one.freedom) * one.u; };
  for (std::size_t i = 0; i < history.entries.size(); ++i) {
    const HistoryEntry& entry = history.entries[i];
    const Estimate &stand = entry.of(Followed::stand), &K_T = entry.of(Followed::thrust_coefficient),
                   &slope = entry.of(Followed::slope);
    text += fmt::format(
        "{:<11} {:>17} {:>22} {:>23}  {}\n", date_of(entry),
        cell(i, Followed::stand, fmt::format("{:+.3f} ± {:.3f}", 100 * (stand.value - 1), 100 * expanded(stand))),
        cell(i, Followed::thrust_coefficient, fmt::format("{:.5e} ± {:.1e}", K_T.value, expanded(K_T))),
        cell(i, Followed::slope, fmt::format("{:.4e} ± {:.1e}", slope.value, expanded(slope))), entry.name);
  }
  text += "\n± is 95 % of what is new in each campaign; * lies outside the limits that hold 99.7 %\n";
  for (const Chart& chart : history.charts)
    text += fmt::format("{:<15} scatter from campaign to campaign beyond that {} %\n", name_of(chart.quantity),
                        two_digits(100 * chart.between));
  text += "\n";
  for (const std::string& line : findings_of(history)) text += line + "\n";
  return text;
}

std::string history_json(const History& history) {
  constexpr std::array<const char*, 3> kinds{"one_off", "shift", "drift"};
  Json charts = Json::array();
  for (const Chart& chart : history.charts) {
    Json points = Json::array();
    for (std::size_t i = 0; i < history.entries.size(); ++i) {
      const Estimate& one = history.entries[i].of(chart.quantity);
      points.push_back({{"name", history.entries[i].name},
                        {"when", history.entries[i].when},
                        {"value", one.value},
                        {"u", one.u},
                        {"limit", chart.limits[i]}});
    }
    Json change = nullptr;
    if (chart.change)
      change = {{"kind", kinds[static_cast<std::size_t>(chart.change->kind)]},
                {"name", history.entries[chart.change->at].name},
                {"share", chart.change->share},
                {"u_share", chart.change->u_share},
                {"p", chart.change->p}};
    charts.push_back({{"quantity", name_of(chart.quantity)},
                      {"unit", unit_of(chart.quantity)},
                      {"centre", chart.centre.value},
                      {"centre_u", chart.centre.u},
                      {"between_campaigns_share", chart.between},
                      {"change", change},
                      {"campaigns", points}});
  }
  const Json json{{"propeller", history.propeller},
                  {"air", history.air == Air::standard ? "standard" : "measured"},
                  {"steady", history.steady()},
                  {"charts", charts},
                  {"findings", findings_of(history)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace kphi::fit
