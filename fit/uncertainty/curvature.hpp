// Is k(φ) a line? The line through the coefficients against their own errors, and against a parabola.
#pragma once

#include <span>

#include "fit/model/line_fit.hpp"
#include "fit/numerics/hypothesis_test.hpp"

namespace kphi::fit {

struct Curvature {
  HypothesisTest lack_of_fit;  ///< of the line: χ²/(m − 2) against the variance of the coefficients
  HypothesisTest quadratic;    ///< F test of the parabola's third term
  double second_order = 0;     ///< N/(rad/s)²/deg², of the parabola
  double second_order_u = 0;
  double linear_aic = 0, quadratic_aic = 0;  ///< corrected for small samples (AICc); the lower one describes better
  [[nodiscard]] bool bends() const { return lack_of_fit.rejected() || quadratic.rejected(); }
};

/// `points` that carry the line (of an anchored one with φ = 0), with standard errors; `freedom` of the variance behind
/// those errors. With 2 points nothing can be tested, with 3 the two tests are the same.
[[nodiscard]] Curvature curvature(std::span<const LinePoint> points, double freedom);

}  // namespace kphi::fit
