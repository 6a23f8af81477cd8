#include "fit/logs/throttle_law.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "base/number.hpp"
#include "base/statistics.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kFewestPoints = 5;

/// Forms whose curves are the same, under the names of each stack.
struct FormNames {
  ThrottleForm form;
  const char* stack;
  std::array<const char*, 2> parameters;  ///< the first is told by full_thrust_n where it is empty
  double scale;                           ///< of the last one
};
constexpr std::array<FormNames, 4> kForms{{{ThrottleForm::px4, "PX4", {"", "THR_MDL_FAC"}, 1},
                                           {ThrottleForm::ardupilot, "ArduPilot", {"", "MOT_THST_EXPO"}, 1},
                                           {ThrottleForm::betaflight, "Betaflight", {"", "thrust_linear"}, 100},
                                           {ThrottleForm::crazyflie, "Crazyflie", {"a in V/N", "b in V/N²"}, 1}}};
const FormNames& names_of(ThrottleForm form) { return kForms[static_cast<std::size_t>(form)]; }

/// m of u = m (1 + t (1 − m)²), which rises for t < 3.
double linearised(double u, double t) {
  double low = 0, high = 1.5;
  for (int i = 0; i < 60; ++i) {
    const double m = (low + high) / 2;
    (m * (1 + t * square(1 - m)) < u ? low : high) = m;
  }
  return (low + high) / 2;
}

/// Sums of a step of Gauss and Newton.
struct Normal {
  double a[3]{};  ///< JᵀJ: 00, 01, 11
  double b[2]{};
  double squares = 0;
};

class Fitter {
 public:
  Fitter(ThrottleForm form, const std::vector<ThrottlePoint>& points) : form_(form), points_(points) {}

  [[nodiscard]] Normal normal(const double (&p)[2]) const {
    Normal sums;
    const double step[2]{1e-6 * std::max(1e-3, std::abs(p[0])), 1e-6 * std::max(1e-3, std::abs(p[1]))};
    const double along_0[2]{p[0] + step[0], p[1]}, along_1[2]{p[0], p[1] + step[1]};
    for (const ThrottlePoint& point : points_) {
      const double thrust = at(p, point), residual = point.thrust_n - thrust;
      const double j0 = (at(along_0, point) - thrust) / step[0], j1 = (at(along_1, point) - thrust) / step[1];
      sums.a[0] += j0 * j0, sums.a[1] += j0 * j1, sums.a[2] += j1 * j1;
      sums.b[0] += j0 * residual, sums.b[1] += j1 * residual;
      sums.squares += residual * residual;
    }
    return sums;
  }

  /// Levenberg and Marquardt; false where it ends nowhere.
  bool solve(double (&p)[2]) const {
    double damping = 1e-3;
    Normal now = normal(p);
    for (int i = 0; i < 200; ++i) {
      const double a00 = now.a[0] * (1 + damping), a11 = now.a[2] * (1 + damping);
      const double determinant = a00 * a11 - square(now.a[1]);
      if (!(determinant > 0)) return false;
      const double move[2]{(a11 * now.b[0] - now.a[1] * now.b[1]) / determinant,
                           (a00 * now.b[1] - now.a[1] * now.b[0]) / determinant};
      const double next[2]{p[0] + move[0], p[1] + move[1]};
      const Normal there = normal(next);
      if (there.squares <= now.squares) {
        const bool done = now.squares - there.squares <= 1e-13 * now.squares;
        p[0] = next[0], p[1] = next[1], now = there, damping /= 5;
        if (done) return true;
      } else if ((damping *= 4) > 1e12) {
        return true;
      }
    }
    return false;
  }

 private:
  [[nodiscard]] double at(const double (&p)[2], const ThrottlePoint& point) const {
    return thrust_of_throttle(form_, p, point.throttle, point.voltage_v);
  }
  ThrottleForm form_;
  const std::vector<ThrottlePoint>& points_;
};

}  // namespace

double thrust_of_throttle(ThrottleForm form, const double (&p)[2], double throttle, double voltage_v) {
  switch (form) {
    case ThrottleForm::px4:
    case ThrottleForm::ardupilot:
      return p[0] * (p[1] * throttle * throttle + (1 - p[1]) * throttle);
    case ThrottleForm::betaflight:
      return p[0] * linearised(throttle, std::clamp(p[1], -0.9, 2.9));
    case ThrottleForm::crazyflie: {
      const double volts = throttle * voltage_v;
      return 2 * volts / (p[0] + std::sqrt(std::max(0.0, p[0] * p[0] + 4 * p[1] * volts)));
    }
  }
  return 0;
}

std::optional<ThrottleLaw> fit_throttle(ThrottleForm form, const std::vector<ThrottlePoint>& points) {
  if (points.size() < kFewestPoints) return std::nullopt;
  double most_n = 0, most_v = 0;
  for (const ThrottlePoint& point : points) {
    most_n = std::max(most_n, point.thrust_n), most_v = std::max(most_v, point.throttle * point.voltage_v);
    if (form == ThrottleForm::crazyflie && !(point.voltage_v > 0)) return std::nullopt;
  }
  const bool volts = form == ThrottleForm::crazyflie;
  double p[2]{volts ? most_v / most_n : most_n, volts ? 0.01 * most_v / square(most_n) : 0.3};
  const Fitter fitter(form, points);
  if (!(most_n > 0) || !fitter.solve(p)) return std::nullopt;
  const Normal sums = fitter.normal(p);
  const auto freedom = static_cast<double>(points.size() - 2);
  const double determinant = sums.a[0] * sums.a[2] - square(sums.a[1]), variance = sums.squares / freedom;
  if (!(determinant > 1e-12 * sums.a[0] * sums.a[2])) return std::nullopt;
  const double u[2]{std::sqrt(variance * sums.a[2] / determinant), std::sqrt(variance * sums.a[0] / determinant)};
  const double t = boost::math::quantile(boost::math::students_t(freedom), 0.975);
  const FormNames& names = names_of(form);
  ThrottleLaw law{form, {}, volts ? results::kNotMeasured : p[0], std::sqrt(variance), points.size()};
  if (volts) law.parameters.push_back({names.parameters[0], p[0], t * u[0]});
  law.parameters.push_back({names.parameters[1], p[1] * names.scale, t * u[1] * names.scale});
  return law;
}

bool told_apart(const ThrottleLaw& one, const ThrottleLaw& other) {
  constexpr double kFivePercent = 3.84;  // of χ² with one degree of freedom
  const double ratio = std::log(square(one.rms_n) / square(other.rms_n));
  return std::abs(static_cast<double>(one.n) * ratio) > kFivePercent;
}

std::vector<std::string> throttle_lines(const ImportedTable& table) {
  constexpr std::size_t kMost = 1000;  // each of a time series brings little beside its neighbours
  std::vector<ThrottlePoint> points;
  const std::size_t every = table.size() / kMost + 1;
  for (std::size_t i = 0; i < table.size(); i += every) {
    const StandRow& row = table.rows[i];
    if (!row.throttle_us || table.is_left_out(i) || !(*row.throttle_us > kIdleUs)) continue;
    points.push_back(
        {(*row.throttle_us - 1000) / 1000, table.thrust_n(i), row.voltage_v.value_or(results::kNotMeasured)});
  }
  std::vector<std::string> lines;
  std::vector<ThrottleLaw> laws;
  for (const FormNames& names : kForms) {
    const auto law = fit_throttle(names.form, points);
    if (!law) continue;
    std::string line = fmt::format("{:<11}", names.stack);
    for (const ThrottleParameter& one : law->parameters)
      line += fmt::format("{} = {}, ", one.name, plain_with_error(one.value, one.half_95));
    lines.push_back(line + fmt::format("rms {:.3g} N (± is 95 % by the scatter of {} rows)", law->rms_n, law->n));
    laws.push_back(*law);
  }
  for (std::size_t i = 0; i < laws.size(); ++i) {
    for (std::size_t j = i + 1; j < laws.size(); ++j) {
      const bool same = laws[i].form == ThrottleForm::px4 && laws[j].form == ThrottleForm::ardupilot;
      if (!same && laws[i].form != ThrottleForm::ardupilot && !told_apart(laws[i], laws[j]))
        lines.push_back(fmt::format("these rows cannot tell the law of {} from that of {}",
                                    names_of(laws[i].form).stack, names_of(laws[j].form).stack));
    }
  }
  return lines;
}

}  // namespace kphi::fit
