#include "fit/uncertainty/thrust_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>

#include "base/number.hpp"
#include "compensation/units.hpp"
#include "results/reduction/bin_statistics.hpp"

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

/// A linear function of the k of the table.
using Weights = std::vector<double>;

double value_of(const Weights& weights, const std::vector<OcclusionCoefficient>& table) {
  double sum = 0;
  for (std::size_t i = 0; i < table.size(); ++i) sum += weights[i] * table[i].k;
  return sum;
}

/// By what is independent from φ to φ.
double u_of(const Weights& weights, const std::vector<OcclusionCoefficient>& table) {
  double squares = 0;
  for (std::size_t i = 0; i < table.size(); ++i)
    if (table[i].standard_error > 0) squares += std::pow(weights[i] * table[i].standard_error, 2);
  return std::sqrt(squares);
}

Weights one_of(const std::vector<OcclusionCoefficient>& table, std::size_t row, double weight = 1) {
  Weights weights(table.size());
  weights[row] = weight;
  return weights;
}

Weights sum_of(Weights a, const Weights& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += b[i];
  return a;
}

/// Slope of the chord from row i to the next, times a width in degrees.
Weights rise_of(const std::vector<OcclusionCoefficient>& table, std::size_t i, double width_deg) {
  const double share = width_deg / (table[i + 1].phi_deg - table[i].phi_deg);
  return sum_of(one_of(table, i, -share), one_of(table, i + 1, share));
}

/// The two ends of where k may lie between two measured φ; both on the chord at a measured one.
struct Between {
  Weights chord, other;
};

/// A curve that bends one way lies between its chord and the chords beside it, drawn on; up to the widest occlusion,
/// with no chord beyond, at most twice as far from it as a parabola. One that falls lies between the k at its ends, and
/// where too few occlusions tell which way it bends, that alone is known.
Between between_occlusions(const std::vector<OcclusionCoefficient>& table, const Chord& chord, double phi_deg) {
  constexpr std::size_t kLeastRows = 4;
  const std::size_t from = chord.before, to = chord.after;
  const Weights at_from = one_of(table, from), at_to = one_of(table, to);
  const Weights middle = sum_of(one_of(table, from, 1 - chord.share), one_of(table, to, chord.share));
  if (from == to) return {at_from, at_from};
  if (table.size() < kLeastRows) return {at_from, at_to};
  std::optional<Weights> aside;
  const auto take = [&](const Weights& beside) {
    if (!aside || std::abs(value_of(beside, table)) < std::abs(value_of(*aside, table))) aside = beside;
  };
  const double on = phi_deg - table[from].phi_deg, left = table[to].phi_deg - phi_deg;
  const double beyond = to + 1 < table.size() ? 1 : 1 - chord.share;
  if (from > 0) take(sum_of(rise_of(table, from - 1, on * beyond), rise_of(table, from, -on * beyond)));
  if (to + 1 < table.size()) take(sum_of(rise_of(table, from, left), rise_of(table, to, -left)));
  const Weights other = sum_of(middle, *aside);
  const bool higher_first = table[from].k > table[to].k;
  const Weights &highest = higher_first ? at_from : at_to, &lowest = higher_first ? at_to : at_from;
  const double k = value_of(other, table);
  if (k > value_of(highest, table)) return {middle, highest};
  if (k < value_of(lowest, table)) return {middle, lowest};
  return {middle, other};
}

/// Where k may lie, and how far from what flies.
struct Deviation {
  Weights end;
  double off = 0;  ///< share of what flies, as seen, less what noise makes of it in the mean
};

/// Of one end of Between; `flown` in the same k.
Deviation deviation_of(const Weights& end, const Weights& flown, double flown_k,
                       const std::vector<OcclusionCoefficient>& table) {
  const auto less = [](Weights a, const Weights& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
    return a;
  };
  const double seen = value_of(end, table) / flown_k - 1, noise = u_of(less(end, flown), table) / flown_k;
  return {end, std::sqrt(std::max(0.0, seen * seen - noise * noise))};
}

/// What the speed does to k(φ) beyond what flies, as shares: one trend for all φ, and what no straight line says of
/// this one.
struct SpeedEffect {
  Estimate per_rad_s{};    ///< as seen, less what noise makes of it in the mean
  double reach_rad_s = 0;  ///< from the speed to which k belongs to the slowest or the fastest one
  double excess = 0;

  /// Of speeds no further than this from the one to which k belongs.
  [[nodiscard]] Estimate within(double off_rad_s) const {
    const double reach = std::min(reach_rad_s, off_rad_s);
    return {std::max(per_rad_s.value * reach, excess), per_rad_s.u * reach, per_rad_s.freedom};
  }
};

SpeedEffect of_speed(const Identification& identification, const ThrustEvidence& evidence, std::size_t row,
                     double reference) {
  SpeedEffect result;
  if (row >= evidence.speed.size() || evidence.speed[row].levels.size() < 2) return result;
  const std::vector<SpeedCoefficient>& levels = evidence.speed[row].levels;
  result.reach_rad_s = std::max(levels.back().speed_rad_s - reference, reference - levels.front().speed_rad_s);
  const double flown = evidence.trend ? evidence.trend->per_rad_s.value : 0;
  if (const auto all = common_trend(evidence.speed))
    result.per_rad_s = {std::sqrt(std::max(0.0, square(all->value - flown) - square(all->u))), all->u, all->freedom};
  double excess = 0, weights = 0;
  for (const SpeedCoefficient& level : levels) {
    if (std::isnan(level.standard_error)) return result;
    const double weight = std::pow(level.speed_rad_s, 4);
    const double expected = identification.table[row].k * (1 + flown * (level.speed_rad_s - reference));
    excess += weight * (std::pow(level.k / expected - 1, 2) - std::pow(level.standard_error / expected, 2));
    weights += weight;
  }
  result.excess = std::sqrt(std::max(0.0, excess / weights));
  return result;
}

class Account {
 public:
  Account(const Identification& identification, const ThrustEvidence& evidence)
      : identification_(identification), evidence_(evidence) {
    if (!identification.alone()) curve_ = identification.curve();
    constexpr std::array kReaches{0.25, 0.5, 0.75, 1.0};
    within_.reference_rad_s = reference_speed(identification);
    double reach = 0;
    for (std::size_t i = 0; i < identification.table.size(); ++i) {
      of_speed_.push_back(of_speed(identification, evidence, i, within_.reference_rad_s));
      reach = std::max(reach, of_speed_.back().reach_rad_s);
    }
    if (!(reach > 0)) within_.off_rad_s = {0};
    for (const double share : kReaches)
      if (reach > 0) within_.off_rad_s.push_back(share * reach);
  }

  /// Without rows.
  [[nodiscard]] const ThrustErrorWithin& within() const { return within_; }

  /// Its `within` has one row, of this φ alone.
  [[nodiscard]] ThrustError at(double phi_deg) const {
    const auto& table = identification_.table;
    const Chord chord = chord_at(table, phi_deg);
    const Weights middle =
        sum_of(one_of(table, chord.before, 1 - chord.share), one_of(table, chord.after, chord.share));
    const double flown = curve_ ? flown_at(phi_deg) : value_of(middle, table);
    const Deviation beside = curve_ ? beside_at(chord, phi_deg, flown) : Deviation{middle};
    Weights weights = beside.end;
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
    add("air density", evidence_.air_density_u.value_or(0), std::numeric_limits<double>::infinity(), "");
    const Estimate steady{0, scatter.combined(), scatter.freedom()};
    const Estimate speed = speed_at(chord, within_.off_rad_s.back());
    const std::string fewer = "fit the speeds of your flight alone (--speed-range-rpm)";
    add("error of the trend of k with the speed", speed.u, speed.freedom, fewer);

    ThrustError error{0, phi_deg, {}};
    const auto take = [&](std::string name, double share, std::string remedy) {
      error.share += share;
      error.parts.push_back({std::move(name), share, std::move(remedy)});
    };
    if (curve_) {
      const bool measured = chord.before == chord.after;
      take(measured ? fmt::format("k(φ) beside the {}", name_of(identification_.curve_fit.form))
                    : fmt::format("k(φ) between {}", between),
           beside.off, measured ? "fit a table (--form table)" : "measure an occlusion there");
    }
    take("k against speed", speed.value, fewer);
    take("a run that stands out", stray(chord), "repeat it, or leave it out (--leave-out)");
    if (phi_deg < first_occlusion())
      take("a plate left on at 0°", evidence_.plate_at_zero, "check it, and repeat the runs at 0° without a plate");
    const double factor = scatter.coverage(), off = error.share - speed.value;
    for (const BudgetRow& row : scatter.rows)
      error.parts.push_back({row.source, factor * row.contribution(), row.remedy});
    const double endless = coverage_factor(std::numeric_limits<double>::infinity());
    error.share = folded(error.share, scatter.combined() * factor / endless);
    std::vector<double> shares;
    for (const double reach : within_.off_rad_s) {
      if (reach == within_.off_rad_s.back()) break;
      const Estimate less = speed_at(chord, reach);
      const double u = std::hypot(steady.u, less.u);
      const double freedom = results::joint_freedom(steady.u, steady.freedom, less.u, less.freedom);
      shares.push_back(folded(off + less.value, u * coverage_factor(freedom) / endless));
    }
    shares.push_back(error.share);
    error.within.rows.push_back({phi_deg, std::move(shares)});
    if (!known) error.share = std::numeric_limits<double>::quiet_NaN(), error.within = {};
    std::erase_if(error.parts, [](const ThrustErrorPart& part) { return !(part.share > 0); });
    std::ranges::stable_sort(error.parts, std::greater{}, &ThrustErrorPart::share);
    return error;
  }

  /// Whether a rotor keeps enough of its thrust there that anything flies on it.
  [[nodiscard]] bool carries(double phi_deg) const {
    return !curve_ || curve_->scaling_factor(from_degrees(phi_deg)) > compensation::kScalingFloor;
  }

 private:
  /// The further end of where k may lie.
  [[nodiscard]] Deviation beside_at(const Chord& chord, double phi_deg, double flown) const {
    const auto& table = identification_.table;
    const Between may = between_occlusions(table, chord, phi_deg);
    const bool held = curve_->scaling_factor(from_degrees(phi_deg)) >= 1;  // at K_T
    const Weights flies = held ? one_of(table, 0) : identification_.curve_fit.weights_at(phi_deg);
    const Deviation near = deviation_of(may.chord, flies, flown, table);
    const Deviation far = deviation_of(may.other, flies, flown, table);
    return far.off > near.off ? far : near;
  }
  [[nodiscard]] Estimate speed_at(const Chord& chord, double off_rad_s) const {
    const Estimate before = of_speed_[chord.before].within(off_rad_s), after = of_speed_[chord.after].within(off_rad_s);
    return before.value > after.value ? before : after;
  }
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
  std::vector<SpeedEffect> of_speed_;  ///< one per row of the table
  ThrustErrorWithin within_;
};

}  // namespace

ThrustError thrust_error(const Identification& identification, const ThrustEvidence& evidence) {
  constexpr int kPieces = 60, kPiecesOfRow = 3;
  constexpr double kFirstContactDeg = 0.01;  // there the line may be beside K_T already
  const Account account(identification, evidence);
  const auto is_measured = [&](double phi) {
    return std::ranges::any_of(identification.table, [phi](const auto& row) { return row.phi_deg == phi; });
  };
  std::set<double> angles;
  for (const OcclusionCoefficient& one : identification.table) angles.insert(one.phi_deg);
  if (angles.size() > 1) angles.insert(kFirstContactDeg);
  for (int i = 1; i < kPieces; ++i) angles.insert(identification.table.back().phi_deg * i / kPieces);
  ThrustError worst;
  ThrustErrorWithin within = account.within();
  std::vector<double> up_to(within.off_rad_s.size());
  std::optional<double> carries_to;
  std::size_t count = 0;
  for (const double phi : angles) {
    if (!account.carries(phi)) {
      carries_to = phi;
      break;
    }
    ThrustError here = account.at(phi);
    if (std::isnan(here.share)) return here;
    for (std::size_t i = 0; i < up_to.size(); ++i) up_to[i] = std::max(up_to[i], here.within.rows.front().shares[i]);
    if (count++ % kPiecesOfRow == 0 || phi == *angles.rbegin() || is_measured(phi)) within.rows.push_back({phi, up_to});
    if (std::isnan(worst.share) || here.share > worst.share) worst = std::move(here);
  }
  worst.within = std::move(within);
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
