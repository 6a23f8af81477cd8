#include "results/reduction/run_zero.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/statistics.hpp"

namespace kphi::results {

void ZeroMovement::add(const StepMean& step) {
  Range& range = of_run_[{step.propeller, step.occlusion_deg, step.repetition}];
  range.moved = step.zero_moved_n;
  range.lowest = std::fmin(range.lowest, step.zero_n);
  range.highest = std::fmax(range.highest, step.zero_n);
  range.least_u_n = std::fmin(range.least_u_n, step.zero_u_n);
}

double ZeroMovement::Range::movement() const {
  return !std::isnan(moved) ? moved : highest > lowest ? highest - lowest : 0;
}

double ZeroMovement::Range::noise_n2() const { return std::isnan(least_u_n) ? 0 : square(2 * least_u_n); }

double ZeroMovement::usual_n() const {
  double squares = 0;
  for (const auto& [run, range] : of_run_) squares += square(range.movement()) / runs();
  return std::sqrt(squares);
}

double ZeroMovement::of_run_n(const StepMean& step) const {
  const auto own = of_run_.find({step.propeller, step.occlusion_deg, step.repetition});
  double wandered = square(usual_n());
  for (const auto& [run, range] : of_run_) wandered -= range.noise_n2() / runs();
  if (own != of_run_.end()) wandered = 0.5 * (wandered + square(own->second.movement()) - own->second.noise_n2());
  return std::sqrt(std::max(0.0, wandered));
}

namespace {

/// Of the parabola through three points, at `x`.
double parabola(const std::array<std::pair<double, double>, 3>& points, double x) {
  double y = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto [own, height] = points[i];
    const double next = points[(i + 1) % 3].first, last = points[(i + 2) % 3].first;
    y += height * (x - next) * (x - last) / ((own - next) * (own - last));
  }
  return y;
}

}  // namespace

void SharedZero::add(double zero_u_n, double begin_s, double end_s, double weight) {
  parts_.push_back({.middle_s = 0.5 * (begin_s + end_s), .weight = weight, .u_n = std::isnan(zero_u_n) ? 0 : zero_u_n});
  weights_ += weight;
  begin_s_ = std::min(begin_s_, begin_s);
  end_s_ = std::max(end_s_, end_s);
}

double SharedZero::measured_variance(double mean_s) const {
  double mean_u = 0;
  for (const Part& part : parts_) mean_u += part.weight / weights_ * part.u_n;
  const auto later = [](const Part& a, const Part& b) { return a.middle_s < b.middle_s; };
  const auto [first, last] = std::ranges::minmax_element(parts_, later);
  const double centre = 0.5 * (first->middle_s + last->middle_s);
  const auto middle =
      std::ranges::min_element(parts_, {}, [&](const Part& part) { return std::abs(part.middle_s - centre); });
  if (!(first->middle_s < middle->middle_s && middle->middle_s < last->middle_s)) return square(mean_u);
  const auto point = [](const Part& part) { return std::pair{part.middle_s, square(part.u_n)}; };
  return std::max(0.0, parabola({point(*first), point(*middle), point(*last)}, mean_s));
}

double SharedZero::u_n(double movement_n) const {
  if (!(weights_ > 0)) return 0;
  // Σ w w' min(s, s') over steps in the order of time, from the sums of those that are later.
  std::vector<Part> sorted = parts_;
  std::ranges::sort(sorted, {}, &Part::middle_s);
  const double span = end_s_ - begin_s_;
  double later = 1, least = 0, mean = 0;
  for (const Part& part : sorted) {
    const double share = span > 0 ? (part.middle_s - begin_s_) / span : 0, weight = part.weight / weights_;
    later -= weight;
    least += share * weight * (weight + 2 * later);
    mean += share * weight;
  }
  const double covariance = span > 0 ? std::max(0.0, least - mean * mean) : 1.0 / 12;
  return std::sqrt(measured_variance(begin_s_ + mean * span) + square(movement_n) * covariance);
}

}  // namespace kphi::results
