// What one run contributes to k: its weighted sums, from which any mixture of runs gives its k by two additions.
#pragma once

#include <span>
#include <vector>

#include "fit/thrust_fit.hpp"

namespace kphi::fit {

struct RunSums {
  double phi_deg = 0;
  int repetition = 0;
  double xt = 0;  ///< Σ w ω² T
  double xx = 0;  ///< Σ w ω⁴
  double x = 0;   ///< Σ w ω²
  double k = 0;   ///< xt/xx, N/(rad/s)²
  std::size_t steps = 0;
  double residual_variance = 0;  ///< of k, from the scatter of the run's steps about k ω²
};

}  // namespace kphi::fit
