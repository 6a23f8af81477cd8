#include "profiles/run_certainty.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::profiles {
namespace {

constexpr double kOfNoise = 0.5, kTwoSided = 2;

double square(const PlannedStep& step) { return step.speed.value() * step.speed.value(); }

}  // namespace

RunCertainty::RunCertainty(const Until& until, std::span<const PlannedStep> steps)
    : until_(until), steps_(steps.size()), to_come_(steps.size()) {
  for (const PlannedStep& step : steps) {
    slowest_ = std::min(slowest_, step.speed.value());
    fastest_ = std::max(fastest_, step.speed.value());
    squares_ += square(step) * square(step);
  }
  squares_to_come_ = squares_;
}

double RunCertainty::wanted_u(double k) const { return kOfNoise * until_.k_share / kTwoSided * std::abs(k); }

bool RunCertainty::needs(const PlannedStep& step) const {
  if (steps_ < kFewestSteps || step.number % 2 == 0 || loudest_n_ == 0) return true;
  if (step.speed.value() <= slowest_ || step.speed.value() >= fastest_) return true;
  const double own = square(step) * square(step);
  const double noise = spent_ + (squares_to_come_ - own) * loudest_n_ * loudest_n_;
  return !(std::sqrt(noise) <= wanted_u(products_ / squares_held_) * (squares_ - own));
}

double RunCertainty::enough_n(const PlannedStep& step, double thrust_n) const {
  const double x = square(step);
  const double k = (products_ + x * thrust_n) / (squares_held_ + x * x);
  const double left = std::pow(wanted_u(k) * squares_, 2) - spent_;
  return std::sqrt(std::max(0.0, left) / static_cast<double>(std::max<std::size_t>(to_come_, 1))) / x;
}

void RunCertainty::passed(double x) {
  to_come_ -= to_come_ > 0 ? 1 : 0;
  squares_to_come_ = to_come_ > 0 ? squares_to_come_ - x * x : 0;
}

void RunCertainty::held(const PlannedStep& step, double thrust_n, double u_n, double held_s) {
  if (!std::isfinite(thrust_n) || !std::isfinite(u_n)) return left_out(step);
  const double x = square(step);
  spent_ += x * x * u_n * u_n;
  products_ += x * thrust_n;
  squares_held_ += x * x;
  loudest_n_ = std::max(loudest_n_, u_n * std::sqrt(std::max(1.0, held_s / until_.dwell_least.value())));
  passed(x);
}

void RunCertainty::left_out(const PlannedStep& step) {
  const double x = square(step);
  squares_ -= x * x;
  passed(x);
}

}  // namespace kphi::profiles
