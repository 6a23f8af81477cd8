#include "compensation/thrust_factor.hpp"

#include <cmath>
#include <limits>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {
namespace {

constexpr Real kMostAcceleration = 1000;        // m/s²
constexpr Real kLeastTold = Real(9.80665) / 4;  // m/s²
constexpr Real kFewestIndependent = 40;         // fewer do not tell how noisy they are
constexpr Real kMostCorrelation = Real(0.995);
constexpr Real kPeriodsInMemory = 100;

}  // namespace

std::optional<ThrustFactor> ThrustFactor::build(const Settings& settings) noexcept {
  const Real memory = settings.memory.value() / settings.period.value();
  const bool in_range = is_positive(settings.mass) && is_positive(settings.period.value()) && is_finite(memory) &&
                        memory >= kPeriodsInMemory && settings.flown_error >= 0 && settings.flown_error < 1;
  if (!in_range) return std::nullopt;
  ThrustFactor built;
  built.mass_ = settings.mass;
  built.keep_ = 1 - 1 / memory;
  built.flown_error_ = settings.flown_error;
  return built;
}

void ThrustFactor::update(Real specific_force, Newtons told) noexcept {
  const Real x = told.value() / mass_;
  weight_ *= keep_;
  squares_ *= keep_;
  squares_twice_ *= keep_ * keep_;
  residuals_ *= keep_;
  neighbours_ *= keep_;
  if (!is_positive(specific_force) || !is_positive(x) || specific_force > kMostAcceleration || x > kMostAcceleration ||
      x < kLeastTold) {
    left_out_ += left_out_ != std::numeric_limits<std::uint32_t>::max() ? 1 : 0;
    residual_ = 0;
    return;
  }
  used_ += used_ != std::numeric_limits<std::uint32_t>::max() ? 1 : 0;
  weight_ += 1;
  squares_ += x * x;
  squares_twice_ += x * x;
  factor_ += x * (specific_force - factor_ * x) / squares_;
  const Real residual = specific_force - factor_ * x;
  residuals_ += residual * residual;
  neighbours_ += residual * residual_;
  residual_ = residual;
}

ThrustFactor::Estimate ThrustFactor::estimate() const noexcept {
  Estimate estimate{factor_, std::numeric_limits<Real>::infinity(), false, false};
  if (!(weight_ > kFewestIndependent)) return estimate;
  Real correlation = residuals_ > 0 ? neighbours_ / residuals_ : 0;
  // A correlation of n samples comes out low by some (1 + 3 ρ)/n.
  correlation += (1 + 3 * correlation) / weight_;
  correlation = correlation < 0 ? 0 : correlation > kMostCorrelation ? kMostCorrelation : correlation;
  const Real samples_as_one = (1 + correlation) / (1 - correlation);
  estimate.known = weight_ > kFewestIndependent * samples_as_one;
  if (!estimate.known) return estimate;
  const Real noise = residuals_ / (weight_ - samples_as_one);
  estimate.u = std::sqrt(noise * samples_as_one * squares_twice_) / squares_;
  estimate.wrong = std::abs(factor_ - 1) > flown_error_ + kSure * estimate.u;
  return estimate;
}

}  // namespace kphi::compensation
