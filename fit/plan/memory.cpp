#include "fit/plan/memory.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::fit {

double averaged(double window_s, double memory_s) {
  if (!(memory_s > 0)) return 1 / window_s;
  const double share = memory_s / window_s;
  return (1 - share * -std::expm1(-1 / share)) / window_s;
}

double neighbours_correlation(double window_s, double apart_s, double memory_s) {
  const double share = memory_s / window_s, within = -std::expm1(-1 / share);
  return share * within * within * std::exp(-(apart_s - window_s) / memory_s) / (2 * (1 - share * within));
}

double memory_of_neighbours(double correlation, double window_s, double apart_s) {
  double low = 1e-3, high = kEndlessMemory;
  for (int i = 0; i < 60; ++i) {
    const double middle = std::sqrt(low * high);
    (neighbours_correlation(window_s, apart_s, middle) < correlation ? low : high) = middle;
  }
  return std::max(low, window_s / 4);
}

}  // namespace kphi::fit
