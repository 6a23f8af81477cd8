#include "results/reduction/lag.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>

namespace kphi::results {
namespace {

constexpr double kLongest = 0.6;      // s, of delay and time constant
constexpr double kEarliest = -0.05;   // s, delay
constexpr double kGrid = 0.04;        // s
constexpr double kConcerned = 1.2;    // s after the command; later bins hold no information about the lag
constexpr double kHistory = 0.3;      // s before it, in which the smoothing forgets its initial value
constexpr double kDerivative = 1e-3;  // s
constexpr double kConverged = 5e-5;   // s
constexpr int kIterations = 25;
constexpr std::size_t kFewSteps = 3;
constexpr double kFewEffectiveSteps = 1.5;  // weighted by their information about the delay
constexpr double kSmoothingSeen = 2;        // a smoothing of fewer standard uncertainties is taken as 0

/// One reading of ω², the integral up to it, and the slope to the next one; 0 behind the last.
struct Knot {
  double time, value, integral = 0, slope = 0;
};

std::vector<Knot> knots_of(std::span<const SquaredSpeed> readings) {
  std::vector<Knot> knots;
  knots.reserve(readings.size());
  for (const SquaredSpeed& reading : readings) {
    Knot knot{reading.time_s, reading.value};
    if (!knots.empty()) {
      Knot& last = knots.back();
      knot.integral = last.integral + 0.5 * (last.value + knot.value) * (knot.time - last.time);
      last.slope = (knot.value - last.value) / (knot.time - last.time);
    }
    knots.push_back(knot);
  }
  return knots;
}

/// A change of speed with the integral of its ω², computed once for all trial shapes.
struct Prepared {
  explicit Prepared(const Transition& t) : transition(t), knots(knots_of(t.squared)) {}
  const Transition& transition;
  std::vector<Knot> knots;
};

/// The integral of ω² between its readings, which are joined by lines.
class Integral {
 public:
  explicit Integral(std::span<const Knot> knots) : knots_(knots) {}

  struct Point {
    double integral, value;
  };
  /// For times that ascend from call to call.
  Point at(double time) {
    if (time <= knots_.front().time) {
      return {(time - knots_.front().time) * knots_.front().value, knots_.front().value};
    }
    while (next_ < knots_.size() && knots_[next_].time <= time) ++next_;
    const Knot& knot = knots_[next_ - 1];
    const double since = time - knot.time;
    if (next_ == knots_.size()) return {knot.integral + since * knot.value, knot.value};
    return {knot.integral + since * (knot.value + 0.5 * knot.slope * since), knot.value + knot.slope * since};
  }

 private:
  std::span<const Knot> knots_;
  std::size_t next_ = 1;
};

/// First-order smoothing of bin means: the input holds within a bin.
class Smoothing {
 public:
  Smoothing(double tau_s, double bin_s) {
    if (tau_s < 1e-6) return;
    decay_ = std::exp(-bin_s / tau_s);
    share_ = tau_s / bin_s * (1 - decay_);
  }
  void start(double value) { state_ = value; }
  double operator()(double value) {
    const double away = state_ - value;
    state_ = value + away * decay_;
    return value + away * share_;
  }

 private:
  double state_ = 0, decay_ = 0, share_ = 0;
};

/// Mean delay and smoothing, s.
using Shape = Eigen::Vector2d;

/// Least squares of one step: the remaining squares, and their derivatives by the shape.
struct Misfit {
  double squares = 0;
  double bins = 0;
  Shape gradient = Shape::Zero();  ///< half the gradient of the squares, pointing downhill
  Eigen::Matrix2d curvature = Eigen::Matrix2d::Zero();
};

/// Of y, x, and, of three and four, x by delay and smoothing.
template <int N>
struct Sums {
  using Values = Eigen::Matrix<double, N, 1>;
  using Products = Eigen::Matrix<double, N, N>;
  double n = 0;
  Values sum = Values::Zero();
  Products product = Products::Zero();
  void add(const Eigen::Vector4d& v) {
    n += 1;
    sum += v.head<N>();
    product += v.head<N>() * v.head<N>().transpose();
  }
  [[nodiscard]] Products centred() const { return product - sum * sum.transpose() / n; }
};

std::ptrdiff_t bins_before(const Transition& transition) {
  return static_cast<std::ptrdiff_t>(transition.before.size());
}

std::ptrdiff_t concerned(const Transition& transition) {
  return std::min(static_cast<std::ptrdiff_t>(transition.thrust.size()),
                  static_cast<std::ptrdiff_t>(kConcerned / transition.bin_s));
}

/// Thrust in a bin counted from the command.
double thrust_in(const Transition& transition, std::ptrdiff_t bin) {
  return bin < 0 ? transition.before[static_cast<std::size_t>(bin + bins_before(transition))]
                 : transition.thrust[static_cast<std::size_t>(bin)];
}

/// `each`(bin, ω² as the thrust has it, and its derivatives by delay and smoothing; by this 0 if it is not smoothed).
template <bool kSmoothed = true, class Each>
void for_each_bin(const Prepared& prepared, const Shape& shape, std::ptrdiff_t bins, Each&& each) {
  const Transition& transition = prepared.transition;
  const double h = transition.bin_s;
  const double delay = shape[0] - shape[1];
  Integral integral(prepared.knots);
  Smoothing value(shape[1], h), slope(shape[1], h), value_on(shape[1] + kDerivative, h);
  const std::ptrdiff_t first = -bins_before(transition);
  const std::ptrdiff_t history = (kSmoothed ? static_cast<std::ptrdiff_t>(kHistory / h) : 0) - first;
  auto left = integral.at(-static_cast<double>(history) * h - delay);
  value.start(left.value);
  value_on.start(left.value);
  slope.start(0);
  for (std::ptrdiff_t i = -history; i < bins; ++i) {
    const auto right = integral.at(static_cast<double>(i + 1) * h - delay);
    const double mean = (right.integral - left.integral) / h;
    const double later = -(right.value - left.value) / h;
    left = right;
    if constexpr (!kSmoothed) {
      each(i, mean, later, 0.0);
      continue;
    }
    const double x = value(mean);
    const double x_delay = slope(later);
    const double x_smooth = (value_on(mean) - x) / kDerivative - x_delay;
    if (i >= first) each(i, x, x_delay, x_smooth);
  }
}

/// With the first `kDerivatives` of the derivatives; unless with both, of a shape without smoothing.
template <int kDerivatives>
Misfit misfit_of(const Prepared& prepared, const Shape& shape) {
  const Transition& transition = prepared.transition;
  Sums<2 + kDerivatives> sums;
  // Relative to the initial levels: sums of squares of the levels themselves would lose the digits.
  const double thrust = transition.thrust.front(), squared = transition.squared.front().value;
  const double level = std::isnan(thrust) ? 0 : thrust;
  for_each_bin<kDerivatives == 2>(prepared, shape, concerned(transition),
                                  [&](std::ptrdiff_t i, double x, double x_delay, double x_smooth) {
                                    const double y = thrust_in(transition, i);
                                    if (!std::isnan(y)) sums.add({y - level, x - squared, x_delay, x_smooth});
                                  });
  Misfit misfit;
  if (sums.n < 4) return misfit;
  const auto c = sums.centred();
  const double yy = c(0, 0), xx = c(1, 1), xy = c(0, 1);
  misfit.bins = sums.n - 2;
  const double b = xx > 0 ? xy / xx : 0;
  if (!(b > 0)) {
    misfit.squares = yy;
    return misfit;
  }
  misfit.squares = yy - b * xy;
  if constexpr (kDerivatives > 0) {
    constexpr int kN = kDerivatives;
    const Eigen::Matrix<double, kN, 1> by_y = c.col(0).template tail<kN>(), by_x = c.col(1).template tail<kN>();
    misfit.gradient.head<kN>() = b * (by_y - b * by_x);
    misfit.curvature.topLeftCorner<kN, kN>() =
        b * b * (c.template bottomRightCorner<kN, kN>() - by_x * by_x.transpose() / xx);
  }
  return misfit;
}

struct Total {
  Misfit sum;
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();  ///< of the gradients
  double weights = 0, squared_weights = 0;
  /// Effective number of steps, weighted by their information about the delay.
  [[nodiscard]] double steps() const { return squared_weights > 0 ? weights * weights / squared_weights : 0; }
};

/// `held`: of a shape without smoothing, and how it changes with the delay alone.
Total misfits(std::span<const Prepared> transitions, const Shape& shape, bool held) {
  Total total;
  for (const Prepared& transition : transitions) {
    const Misfit one = held ? misfit_of<1>(transition, shape) : misfit_of<2>(transition, shape);
    total.sum.squares += one.squares;
    total.sum.bins += one.bins;
    total.sum.gradient += one.gradient;
    total.sum.curvature += one.curvature;
    total.scatter += one.gradient * one.gradient.transpose();
    total.weights += one.curvature(0, 0);
    total.squared_weights += one.curvature(0, 0) * one.curvature(0, 0);
  }
  return total;
}

Shape clamped(const Shape& shape) {
  const double smoothing = std::clamp(shape[1], 0.0, kLongest);
  return {std::clamp(shape[0], kEarliest + smoothing, kLongest + smoothing), smoothing};
}

/// Gauss-Newton step with Marquardt's damping; at the edge of no smoothing only the delay moves.
Shape step_of(const Misfit& m, const Shape& at, double damping, bool held) {
  const double dd = m.curvature(0, 0) * (1 + damping), ds = m.curvature(0, 1), ss = m.curvature(1, 1) * (1 + damping);
  const double det = dd * ss - ds * ds;
  if (held || !(det > 1e-9 * dd * ss)) return {dd > 0 ? m.gradient[0] / dd : 0.0, 0.0};
  const Shape step{(ss * m.gradient[0] - ds * m.gradient[1]) / det, (dd * m.gradient[1] - ds * m.gradient[0]) / det};
  if (at[1] + step[1] >= 0) return step;
  return {(m.gradient[0] + ds * at[1]) / dd, -at[1]};
}

double best_of_grid(std::span<const Prepared> transitions) {
  double best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (double delay = kEarliest + kGrid; delay < kLongest; delay += kGrid) {
    double squares = 0;
    // From the last on: as a rule the fastest, whose misfit alone can be too large.
    for (auto step = transitions.rbegin(); step != transitions.rend() && squares < least; ++step)
      squares += misfit_of<0>(*step, {delay, 0.0}).squares;
    if (squares >= least) continue;
    least = squares;
    best = delay;
  }
  return best;
}

/// Standard uncertainty of the delay because the speed may change at any time between two readings, s. It averages out
/// over steps whose readings fall at any distance from the command; the part that does not is the resultant of these
/// distances, as angles on a circle of one reading interval (1: all readings keep the same distance, no averaging).
/// science.md, eq. 11.
double u_between_readings(std::span<const Prepared> transitions) {
  std::complex<double> resultant = 0;
  double variance = 0, weights = 0;
  for (const Prepared& prepared : transitions) {
    const std::vector<Knot>& knots = prepared.knots;
    const auto later_than = [](double time) { return [time](const Knot& knot) { return knot.time > time; }; };
    const auto first = std::find_if(std::next(knots.begin()), knots.end(), later_than(0));
    const auto last = std::find_if(first, knots.end(), later_than(kConcerned));
    if (first == last) continue;
    for (auto knot = first; knot != last; ++knot) {
      const double interval = knot->time - std::prev(knot)->time;
      variance += std::pow((knot->value - std::prev(knot)->value) * interval, 2) / 12;
    }
    const double weight = std::pow(std::prev(last)->value - std::prev(first)->value, 2);
    resultant += std::polar(weight, 2 * M_PI * first->time / (first->time - std::prev(first)->time));
    weights += weight;
  }
  return weights > 0 ? std::abs(resultant) / weights * std::sqrt(variance / weights) : 0;
}

/// Standard uncertainties of mean delay and smoothing: from the residuals, and from the scatter between the steps
/// (sandwich), which a few steps alone underestimate. Only of the delay when the smoothing is held.
Shape uncertainties(const Total& total, bool held) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const double n = total.steps();
  const Eigen::Matrix2d &h = total.sum.curvature, &g = total.scatter;
  if (n < kFewEffectiveSteps || !(h(0, 0) > 0)) return {kUnknown, kUnknown};
  const double spare = n / std::max(n - (held ? 1 : 2), 0.5);
  const double noise = total.sum.squares / std::max(total.sum.bins, 1.0);
  if (held) return {std::sqrt(spare * g(0, 0) / (h(0, 0) * h(0, 0)) + noise / h(0, 0)), kUnknown};
  const double det = h.determinant();
  const double a = h(1, 1) / det, b = -h(0, 1) / det, c = h(0, 0) / det;
  return {std::sqrt(spare * (a * a * g(0, 0) + 2 * a * b * g(0, 1) + b * b * g(1, 1)) + noise * a),
          std::sqrt(spare * (b * b * g(0, 0) + 2 * b * c * g(0, 1) + c * c * g(1, 1)) + noise * c)};
}

struct Fitted {
  Shape shape;
  Total total;
};

/// Least squares from `shape` on; `held`: without smoothing.
Fitted fitted(std::span<const Prepared> transitions, Shape shape, bool held) {
  Total now = misfits(transitions, shape, held);
  double damping = 1e-3;
  for (int i = 0; i < kIterations; ++i) {
    const Shape next = clamped(shape + step_of(now.sum, shape, damping, held));
    const double moved = (next - shape).cwiseAbs().maxCoeff();
    const Total then = misfits(transitions, next, held);
    if (then.sum.squares <= now.sum.squares) {
      shape = next;
      now = then;
      damping *= 0.2;
    } else {
      damping = std::max(damping * 10, 1e-4);
    }
    if (moved < kConverged) break;
  }
  return {shape, now};
}

}  // namespace

Lag estimate_lag(std::span<const Transition> transitions) {
  std::vector<Prepared> usable;
  for (const Transition& transition : transitions) {
    if (transition.squared.size() > 2 && !transition.thrust.empty()) usable.emplace_back(transition);
  }
  if (usable.size() < kFewSteps) return {};
  Fitted best = fitted(usable, {best_of_grid(usable), 0.0}, true);
  Shape u = uncertainties(best.total, true);
  // Start at half the delay: at no smoothing at all its derivative equals that of the delay.
  const Fitted smooth = fitted(usable, {best.shape[0], std::max(0.5 * best.shape[0], 0.0)}, false);
  const Shape u_smooth = uncertainties(smooth.total, false);
  if (smooth.shape[1] > kSmoothingSeen * u_smooth[1]) {
    best = smooth;
    u = u_smooth;
  }
  const double delay = best.shape[0] - best.shape[1];
  const bool at_edge = delay <= kEarliest || delay >= kLongest || best.shape[1] >= kLongest;
  Lag lag{best.shape[0], std::hypot(u[0], u_between_readings(usable)), best.shape[1],
          std::max(best.total.steps() - 1, 1.0)};
  if (at_edge) lag.u = std::numeric_limits<double>::quiet_NaN();
  return lag;
}

std::vector<double> delayed(const Transition& transition, const Lag& lag) {
  std::vector<double> squared(transition.thrust.size());
  if (transition.squared.size() < 2) return std::vector<double>(squared.size(), std::nan(""));
  for_each_bin(Prepared(transition), {lag.seconds, lag.smoothing}, static_cast<std::ptrdiff_t>(squared.size()),
               [&](std::ptrdiff_t i, double x, double, double) {
                 if (i >= 0) squared[static_cast<std::size_t>(i)] = x;
               });
  return squared;
}

}  // namespace kphi::results
