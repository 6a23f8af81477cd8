#include "fit/logs/throttle_law.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>

#include "base/number.hpp"
#include "base/statistics.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kFewestPoints = 5, kMostTerms = 4;

struct FormFacts {
  ThrottleForm form;
  const char* name;
  const char* words;
  std::array<const char*, kMostTerms> parameters;  ///< "": of no stack, thrust at full throttle; nullptr: none
  double scale;                                    ///< of the last one
  double low, high;                                ///< throttle at x = 0 and 1
  bool needs_voltage;
};
constexpr std::array<FormFacts, kThrottleForms.size()> kThrottleFacts{
    {{ThrottleForm::px4, "px4", "PX4", {"", "THR_MDL_FAC"}, 1, 0, 1, false},
     {ThrottleForm::ardupilot, "ardupilot", "ArduPilot", {"", "MOT_THST_EXPO"}, 1, 0.15, 0.95, false},
     {ThrottleForm::ardupilot_voltage,
      "ardupilot_voltage",
      "ArduPilot with voltage",
      {"", "MOT_THST_EXPO"},
      1,
      0.15,
      0.95,
      true},
     {ThrottleForm::betaflight, "betaflight", "Betaflight from 2026.6", {"", "thrust_linear"}, 100, 0.055, 1, false},
     {ThrottleForm::betaflight_4_2,
      "betaflight_4_2",
      "Betaflight to 2025.12",
      {"", "thrust_linear"},
      100,
      0.055,
      1,
      false},
     {ThrottleForm::crazyflie,
      "crazyflie",
      "Crazyflie",
      {"VMOTOR2THRUST0", "VMOTOR2THRUST1", "VMOTOR2THRUST2", "VMOTOR2THRUST3"},
      1,
      0,
      1,
      true}}};
const FormFacts& throttle_facts(ThrottleForm form) { return kThrottleFacts[static_cast<std::size_t>(form)]; }

std::size_t terms_of(const FormFacts& facts) {
  return static_cast<std::size_t>(std::ranges::find(facts.parameters, nullptr) - facts.parameters.begin());
}

/// m of x = c₁ m + c₂ m² + c₃ m³, which rises from 0 at 0 to 1 at 1; straight on beyond full throttle, where it turns.
double throttle_of_cubic(double x, const std::array<double, 3>& c) {
  constexpr double kMost = 1.5;
  constexpr int kBits = 48;
  if (!(x > 0)) return 0;
  if (!(x < 1)) return std::min(x, kMost);
  const auto off = [&](double m) {
    return std::pair(m * (c[0] + m * (c[1] + m * c[2])) - x, c[0] + m * (2 * c[1] + 3 * m * c[2]));
  };
  return boost::math::tools::newton_raphson_iterate(off, x, 0.0, 1.0, kBits);
}

using ThrottleTerms = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostTerms, 1>;
using ThrottleSquares = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostTerms, kMostTerms>;

/// Sums of a step of Gauss and Newton.
struct ThrottleSums {
  ThrottleSquares a;  ///< JᵀJ
  ThrottleTerms b;
  double squares = 0;
};

/// Fits the points between the form's ends.
class ThrottleFitter {
 public:
  ThrottleFitter(ThrottleForm form, const std::vector<ThrottlePoint>& points) : facts_(throttle_facts(form)) {
    for (const ThrottlePoint& point : points)
      if (!(point.throttle < facts_.low) && point.throttle <= facts_.high + 1e-9) points_.push_back(point);
    for (const ThrottlePoint& point : points_) {
      has_voltage_ = has_voltage_ && point.voltage_v > 0;
      most_v_ = std::max(most_v_, point.voltage_v);
      most_n_ = std::max(most_n_, point.thrust_n);
    }
    if (form != ThrottleForm::ardupilot_voltage) return;
    for (ThrottlePoint& point : points_) point.voltage_v /= most_v_;
  }

  /// False where the points do not tell.
  bool solve() {
    const std::size_t terms = terms_of(facts_);
    if (points_.size() < std::max(kFewestPoints, terms + 2) || !(most_n_ > 0)) return false;
    if (facts_.needs_voltage && !has_voltage_) return false;
    p_ = ThrottleTerms::Zero(static_cast<Eigen::Index>(terms));
    if (terms == kMostTerms) {
      p_[1] = most_n_ / most_v_;
    } else {
      p_[0] = most_n_, p_[1] = 0.3;
    }
    return iterate() && tells();
  }

  [[nodiscard]] ThrottleLaw law() const {
    ThrottleLaw law{facts_.form, {}, {}, std::sqrt(variance_), points_.size()};
    const double t = boost::math::quantile(boost::math::students_t(freedom()), 0.975);
    for (Eigen::Index i = 0; i < p_.size(); ++i) {
      const char* const name = facts_.parameters[static_cast<std::size_t>(i)];
      const double scale = i + 1 == p_.size() ? facts_.scale : 1;
      law.parameters.push_back({*name == '\0' ? "full_thrust_n" : name, p_[i] * scale,
                                t * std::sqrt(variance_ * covariance_(i, i)) * scale});
    }
    if (facts_.form != ThrottleForm::ardupilot && facts_.form != ThrottleForm::ardupilot_voltage) return law;
    law.parameters.push_back({"MOT_SPIN_MIN", facts_.low, 0});
    law.parameters.push_back({"MOT_SPIN_MAX", facts_.high, 0});
    if (facts_.needs_voltage) law.parameters.push_back({"MOT_BAT_VOLT_MAX", most_v_, 0});
    return law;
  }

  [[nodiscard]] double squares() const { return variance_ * freedom(); }

 private:
  [[nodiscard]] double freedom() const { return static_cast<double>(points_.size()) - static_cast<double>(p_.size()); }
  [[nodiscard]] double at(const ThrottleTerms& p, const ThrottlePoint& point) const {
    return thrust_of_throttle(facts_.form, {p.data(), static_cast<std::size_t>(p.size())}, point.throttle,
                              point.voltage_v);
  }

  [[nodiscard]] ThrottleSums normal(const ThrottleTerms& p) const {
    const Eigen::Index terms = p.size();
    ThrottleSums sums{ThrottleSquares::Zero(terms, terms), ThrottleTerms::Zero(terms), 0};
    for (const ThrottlePoint& point : points_) {
      const double thrust = at(p, point), residual = point.thrust_n - thrust;
      ThrottleTerms j(terms);
      for (Eigen::Index i = 0; i < terms; ++i) {
        const double step = 1e-6 * std::max(1e-3, std::abs(p[i]));
        ThrottleTerms moved = p;
        moved[i] += step;
        j[i] = (at(moved, point) - thrust) / step;
      }
      sums.a += j * j.transpose();
      sums.b += residual * j;
      sums.squares += residual * residual;
    }
    return sums;
  }

  /// Levenberg and Marquardt; false where it ends nowhere.
  bool iterate() {
    double damping = 1e-3;
    ThrottleSums now = normal(p_);
    for (int i = 0; i < 200; ++i) {
      ThrottleSquares a = now.a;
      a.diagonal() *= 1 + damping;
      const ThrottleTerms next = p_ + ThrottleTerms(a.ldlt().solve(now.b));
      if (!next.allFinite()) return false;
      const ThrottleSums there = normal(next);
      if (there.squares <= now.squares) {
        const bool done = now.squares - there.squares <= 1e-13 * now.squares;
        p_ = next, now = there, damping /= 5;
        if (done) return true;
      } else if ((damping *= 4) > 1e12) {
        return true;
      }
    }
    return false;
  }

  /// Takes variance and covariance; false if some parameters can be exchanged for others.
  bool tells() {
    const ThrottleSums sums = normal(p_);
    const ThrottleTerms size = sums.a.diagonal().cwiseSqrt();
    if (!(size.minCoeff() > 0)) return false;
    const ThrottleSquares scaled = size.cwiseInverse().asDiagonal() * sums.a * size.cwiseInverse().asDiagonal();
    if (!(Eigen::SelfAdjointEigenSolver<ThrottleSquares>(scaled, Eigen::EigenvaluesOnly).eigenvalues().minCoeff() >
          1e-9))
      return false;
    covariance_ =
        size.cwiseInverse().asDiagonal() * ThrottleSquares(scaled.inverse()) * size.cwiseInverse().asDiagonal();
    variance_ = sums.squares / freedom();
    return true;
  }

  const FormFacts& facts_;
  std::vector<ThrottlePoint> points_;
  bool has_voltage_ = true;
  double most_v_ = 0, most_n_ = 0;
  ThrottleTerms p_;
  ThrottleSquares covariance_;
  double variance_ = 0;
};

std::string line_of_law(const ThrottleLaw& law) {
  std::string line = fmt::format("{:<22} ", throttle_facts(law.form).words);
  for (const ThrottleParameter& one : law.parameters) {
    if (one.name == "full_thrust_n") continue;
    line += fmt::format("{} = {}, ", one.name,
                        one.half_95 > 0 ? plain_with_error(one.value, one.half_95) : fmt::format("{:.4g}", one.value));
  }
  return line + fmt::format("rms {:.3g} N (± is 95 % by the scatter of {} rows)", law.rms_n, law.n);
}

}  // namespace

const char* name_of(ThrottleForm form) { return throttle_facts(form).name; }

double thrust_of_throttle(ThrottleForm form, std::span<const double> p, double throttle, double voltage) {
  const FormFacts& facts = throttle_facts(form);
  const double x = (throttle - facts.low) / (facts.high - facts.low);
  const auto parabola = [&](double along) { return p[0] * (p[1] * along * along + (1 - p[1]) * along); };
  switch (form) {
    case ThrottleForm::px4:
    case ThrottleForm::ardupilot:
      return parabola(x);
    case ThrottleForm::ardupilot_voltage:
      return parabola(x * voltage);
    case ThrottleForm::betaflight: {
      const double e = std::clamp(p[1], -1.25, 1.25);  // beyond, the curve does not rise everywhere
      // m (1 + e (1 − m) (1 + e (1 − 2 m)))
      return p[0] * throttle_of_cubic(x, {1 + e + e * e, -e - 3 * e * e, 2 * e * e});
    }
    case ThrottleForm::betaflight_4_2: {
      const double t = std::clamp(p[1], -0.9, 2.9);
      return p[0] * throttle_of_cubic(x, {1 + t, -2 * t, t});  // m (1 + t (1 − m)²)
    }
    case ThrottleForm::crazyflie: {
      const double v = throttle * voltage;
      return p[0] + v * (p[1] + v * (p[2] + v * p[3]));
    }
  }
  return 0;
}

std::optional<ThrottleLaw> fit_throttle(ThrottleForm form, const std::vector<ThrottlePoint>& points) {
  ThrottleFitter fitter(form, points);
  return fitter.solve() ? std::optional(fitter.law()) : std::nullopt;
}

bool told_apart(ThrottleForm one, ThrottleForm other, const std::vector<ThrottlePoint>& points) {
  const FormFacts &a = throttle_facts(one), &b = throttle_facts(other);
  std::vector<ThrottlePoint> common = points;
  std::erase_if(common, [&](const ThrottlePoint& point) {
    return point.throttle < std::max(a.low, b.low) || point.throttle > std::min(a.high, b.high) + 1e-9;
  });
  ThrottleFitter of_one(one, common), of_other(other, common);
  if (!of_one.solve() || !of_other.solve()) return false;
  const double more = std::abs(static_cast<double>(terms_of(a)) - static_cast<double>(terms_of(b)));
  const double limit = boost::math::quantile(boost::math::chi_squared(1 + more), 0.95);
  return std::abs(static_cast<double>(common.size()) * std::log(of_one.squares() / of_other.squares())) > limit;
}

std::vector<ThrottleLaw> throttle_laws(const ImportedTable& table) {
  constexpr std::size_t kMost = 1000;  // each of a time series brings little beside its neighbours
  std::vector<ThrottlePoint> points;
  const std::size_t every = table.size() / kMost + 1;
  for (std::size_t i = 0; i < table.size(); i += every) {
    const StandRow& row = table.rows[i];
    if (!row.throttle_us || table.is_left_out(i) || !(*row.throttle_us > kIdleUs)) continue;
    points.push_back(
        {(*row.throttle_us - 1000) / 1000, table.thrust_n(i), row.voltage_v.value_or(results::kNotMeasured)});
  }
  std::vector<ThrottleLaw> laws;
  for (const ThrottleForm form : kThrottleForms)
    if (auto law = fit_throttle(form, points)) laws.push_back(std::move(*law));
  for (std::size_t i = 0; i < laws.size(); ++i) {
    for (std::size_t j = i + 1; j < laws.size(); ++j) {
      if (told_apart(laws[i].form, laws[j].form, points)) continue;
      laws[i].not_told_from.push_back(laws[j].form);
      laws[j].not_told_from.push_back(laws[i].form);
    }
  }
  return laws;
}

std::vector<std::string> throttle_lines(const std::vector<ThrottleLaw>& laws) {
  std::vector<std::string> lines, apart;
  for (const ThrottleLaw& law : laws) {
    lines.push_back(line_of_law(law));
    std::vector<std::string> others;
    for (const ThrottleForm form : law.not_told_from)
      if (form > law.form) others.emplace_back(throttle_facts(form).words);
    if (!others.empty())
      apart.push_back(fmt::format("these rows cannot tell the law of {} from that of {}",
                                  throttle_facts(law.form).words, fmt::join(others, ", ")));
  }
  std::ranges::move(apart, std::back_inserter(lines));
  return lines;
}

}  // namespace kphi::fit
