#include "fit/uncertainty/thrust_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>

#include "base/number.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

/// Half of the interval around 0 that holds a normal error of mean `off` and deviation `u` 95 times of 100: 1.96 u at
/// none, off + 1.645 u where it is large.
double folded(double off, double u) {
  if (!(u > 0)) return off;
  const auto inside = [&](double q) {
    return 0.5 * (std::erf((q - off) / (u * std::numbers::sqrt2)) + std::erf((q + off) / (u * std::numbers::sqrt2)));
  };
  double low = off, high = off + 2 * u;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (inside(middle) < 0.95 ? low : high) = middle;
  }
  return high;
}

/// k as measured, joined by chords.
struct Chord {
  std::size_t before = 0, after = 0;  ///< rows of the table; the same at a measured φ
  double share = 0;                   ///< of the way from one to the other
};

Chord chord_at(const std::vector<OcclusionCoefficient>& table, double phi_deg) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (std::abs(table[i].phi_deg - phi_deg) < kSameAngleDeg) return {i, i, 0};
    if (table[i].phi_deg > phi_deg && i > 0)
      return {i - 1, i, (phi_deg - table[i - 1].phi_deg) / (table[i].phi_deg - table[i - 1].phi_deg)};
  }
  return {table.size() - 1, table.size() - 1, 0};
}

double slope(const std::vector<OcclusionCoefficient>& table, std::size_t i) {
  return (table[i + 1].k - table[i].k) / (table[i + 1].phi_deg - table[i].phi_deg);
}

/// Where k may lie between two measured φ, N/(rad/s)²; both on the chord at a measured one.
struct Between {
  double low = 0, high = 0;
};

/// A curve that bends one way lies between its chord and the chords beside it, drawn on; up to the widest occlusion,
/// with no chord beyond, at most twice as far from it as a parabola. One that falls lies between the k at its ends, and
/// where too few occlusions tell which way it bends, that alone is known.
Between between_occlusions(const std::vector<OcclusionCoefficient>& table, const Chord& chord, double phi_deg) {
  constexpr std::size_t kLeastRows = 4;
  const OcclusionCoefficient &from = table[chord.before], &to = table[chord.after];
  const double k = from.k * (1 - chord.share) + to.k * chord.share;
  if (chord.before == chord.after) return {k, k};
  const Between falls{std::min(from.k, to.k), std::max(from.k, to.k)};
  if (table.size() < kLeastRows) return falls;
  const double here = slope(table, chord.before);
  double aside = std::numeric_limits<double>::infinity();
  const auto take = [&](double beside) {
    if (std::abs(beside) < std::abs(aside)) aside = beside;
  };
  const double beyond = chord.after + 1 < table.size() ? 1 : 1 - chord.share;
  if (chord.before > 0) take((slope(table, chord.before - 1) - here) * (phi_deg - from.phi_deg) * beyond);
  if (chord.after + 1 < table.size()) take((here - slope(table, chord.after)) * (to.phi_deg - phi_deg));
  const double there = std::clamp(k + aside, falls.low, falls.high);
  return {std::min(k, there), std::max(k, there)};
}

/// What the speed does to k(φ) beyond what flies, at the slowest or the fastest speed; value and u as shares. One
/// trend for all φ, and what no straight line says of this one.
Estimate of_speed(const Identification& identification, const ThrustEvidence& evidence, std::size_t row) {
  if (row >= evidence.speed.size() || evidence.speed[row].levels.size() < 2) return {};
  const std::vector<SpeedCoefficient>& levels = evidence.speed[row].levels;
  const double reference = reference_speed(identification);
  const double reach = std::max(levels.back().speed_rad_s - reference, reference - levels.front().speed_rad_s);
  const double flown = evidence.trend ? evidence.trend->per_rad_s.value : 0;
  Estimate result;
  if (const auto all = common_trend(evidence.speed))
    result = {std::abs(all->value - flown) * reach, all->u * reach, all->freedom};
  double excess = 0, weights = 0;
  for (const SpeedCoefficient& level : levels) {
    if (std::isnan(level.standard_error)) return result;
    const double weight = std::pow(level.speed_rad_s, 4);
    const double expected = identification.table[row].k * (1 + flown * (level.speed_rad_s - reference));
    excess += weight * (std::pow(level.k / expected - 1, 2) - std::pow(level.standard_error / expected, 2));
    weights += weight;
  }
  result.value = std::max(result.value, std::sqrt(std::max(0.0, excess / weights)));
  return result;
}

class Account {
 public:
  Account(const Identification& identification, const ThrustEvidence& evidence)
      : identification_(identification), evidence_(evidence) {
    if (!identification.alone()) curve_ = identification.curve();
    for (std::size_t i = 0; i < identification.table.size(); ++i)
      of_speed_.push_back(of_speed(identification, evidence, i));
  }

  [[nodiscard]] ThrustError at(double phi_deg) const {
    const auto& table = identification_.table;
    const Chord chord = chord_at(table, phi_deg);
    std::vector<double> weights(table.size());
    weights[chord.before] += 1 - chord.share;
    weights[chord.after] += chord.share;
    const double k = table[chord.before].k * (1 - chord.share) + table[chord.after].k * chord.share;
    const double flown = curve_ ? flown_at(phi_deg) : k;
    for (double& weight : weights) weight /= flown;
    Budget scatter = evidence_.sources.budget("thrust", "1", 1, weights);
    const bool known = !std::isnan(scatter.combined());
    const auto between = fmt::format("{:g}° and {:g}°", table[chord.before].phi_deg, table[chord.after].phi_deg);
    const auto add = [&](const char* source, double u, double freedom, std::string remedy) {
      scatter.rows.push_back({.source = source,
                              .evaluation = Evaluation::type_b,
                              .u = u,
                              .unit = "1",
                              .sensitivity = 1,
                              .freedom = freedom,
                              .remedy = std::move(remedy)});
    };
    const Estimate &before = of_speed_[chord.before], &after = of_speed_[chord.after];
    const Estimate& speed = before.value > after.value ? before : after;
    const std::string fewer = "fit the speeds of your flight alone (--speed-range-rpm)";
    add("error of the trend of k with the speed", speed.u, speed.freedom, fewer);
    add("air density", evidence_.air_density_u.value_or(0), std::numeric_limits<double>::infinity(), "");

    ThrustError error{0, phi_deg, {}};
    const auto take = [&](std::string name, double share, std::string remedy) {
      error.share += share;
      error.parts.push_back({std::move(name), share, std::move(remedy)});
    };
    if (curve_) {
      const Between may = between_occlusions(table, chord, phi_deg);
      const double beside = std::max(std::abs(may.low / flown - 1), std::abs(may.high / flown - 1));
      const bool measured = chord.before == chord.after;
      take(measured ? fmt::format("k(φ) beside the {}", name_of(identification_.curve_fit.form))
                    : fmt::format("k(φ) between {}", between),
           beside, measured ? "fit a table (--form table)" : "measure an occlusion there");
    }
    take("k against speed", speed.value, fewer);
    take("a run that stands out", stray(chord), "repeat it, or leave it out (--leave-out)");
    if (phi_deg < first_occlusion())
      take("a plate left on at 0°", evidence_.plate_at_zero, "check it, and repeat the runs at 0° without a plate");
    const double factor = scatter.coverage();
    for (const BudgetRow& row : scatter.rows)
      error.parts.push_back({row.source, factor * row.contribution(), row.remedy});
    error.share =
        folded(error.share, scatter.combined() * factor / coverage_factor(std::numeric_limits<double>::infinity()));
    if (!known) error.share = std::numeric_limits<double>::quiet_NaN();
    std::erase_if(error.parts, [](const ThrustErrorPart& part) { return !(part.share > 0); });
    std::ranges::stable_sort(error.parts, std::greater{}, &ThrustErrorPart::share);
    return error;
  }

  /// Whether a rotor keeps enough of its thrust there that anything flies on it.
  [[nodiscard]] bool carries(double phi_deg) const {
    return !curve_ || curve_->scaling_factor(from_degrees(phi_deg)) > compensation::kScalingFloor;
  }

 private:
  [[nodiscard]] double flown_at(double phi_deg) const {
    return curve_->thrust_coefficient().value() * curve_->scaling_factor(from_degrees(phi_deg));
  }
  [[nodiscard]] double first_occlusion() const {
    return identification_.table.size() > 1 ? identification_.table[1].phi_deg : 360;
  }
  /// By how much a run that stands out moves the mean of its φ.
  [[nodiscard]] double stray(const Chord& chord) const {
    double largest = 0;
    for (const OutlyingRun& run : evidence_.outlying)
      for (const std::size_t row : {chord.before, chord.after})
        if (identification_.table[row].phi_deg == run.phi_deg)
          largest = std::max(largest, std::abs(run.share) / static_cast<double>(std::max<std::size_t>(
                                                                1, identification_.table[row].repetitions)));
    return largest;
  }

  const Identification& identification_;
  const ThrustEvidence& evidence_;
  std::optional<compensation::ThrustCurve> curve_;
  std::vector<Estimate> of_speed_;  ///< one per row of the table
};

}  // namespace

ThrustError thrust_error(const Identification& identification, const ThrustEvidence& evidence) {
  constexpr int kPieces = 60;
  constexpr double kFirstContactDeg = 0.01;  // there the line may be beside K_T already
  const Account account(identification, evidence);
  std::set<double> angles;
  for (const OcclusionCoefficient& one : identification.table) angles.insert(one.phi_deg);
  if (angles.size() > 1) angles.insert(kFirstContactDeg);
  for (int i = 1; i < kPieces; ++i) angles.insert(identification.table.back().phi_deg * i / kPieces);
  ThrustError worst;
  std::optional<double> carries_to;
  for (const double phi : angles) {
    if (!account.carries(phi)) {
      carries_to = phi;
      break;
    }
    ThrustError here = account.at(phi);
    if (std::isnan(here.share)) return here;
    if (std::isnan(worst.share) || here.share > worst.share) worst = std::move(here);
  }
  worst.carries_to_deg = carries_to;
  return worst;
}

std::string words(const ThrustError& error) {
  if (std::isnan(error.share)) return "error of the thrust unknown";
  std::string text = fmt::format("thrust within {} % (95 %)", two_digits(100 * error.share));
  if (error.parts.empty()) return text;
  const ThrustErrorPart& largest = error.parts.front();
  text += fmt::format(", most of it {}, {} %", largest.name, two_digits(100 * largest.share));
  return largest.remedy.empty() ? text : text + ": " + largest.remedy;
}

}  // namespace kphi::fit
