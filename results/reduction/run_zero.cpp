#include "results/reduction/run_zero.hpp"

#include <algorithm>
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

void SharedZero::add(double zero_u_n, double begin_s, double end_s, double weight) {
  parts_.push_back({begin_s, end_s, weight});
  weights_ += weight;
  if (!std::isnan(zero_u_n)) measured_ += weight * zero_u_n;
}

double SharedZero::u_n(double movement_n) const {
  if (!(weights_ > 0)) return 0;
  const double begin = std::ranges::min(parts_, {}, &Part::begin_s).begin_s,
               end = std::ranges::max(parts_, {}, &Part::end_s).end_s;
  double covariance = 1.0 / 12;
  if (end > begin) {
    // Σ w w' min(s, s') over steps in the order of time, from the sums of those that are later.
    std::vector<std::pair<double, double>> sorted;
    for (const Part& part : parts_)
      sorted.emplace_back((0.5 * (part.begin_s + part.end_s) - begin) / (end - begin), part.weight / weights_);
    std::ranges::sort(sorted);
    double later = 1, least = 0, mean = 0;
    for (const auto& [share, weight] : sorted) {
      later -= weight;
      least += share * weight * (weight + 2 * later);
      mean += share * weight;
    }
    covariance = std::max(0.0, least - mean * mean);
  }
  return std::hypot(measured_ / weights_, movement_n * std::sqrt(covariance));
}

}  // namespace kphi::results
