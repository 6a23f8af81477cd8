#include "results/reduction/next_run.hpp"

#include <cmath>
#include <limits>

#include "results/reduction/bin_statistics.hpp"

namespace kphi::results {

double moved_by_next_run(std::span<const RepetitionVerdict> verdicts, double occlusion_deg) {
  double squares = 0, freedom = 0, runs = 0;
  for (const RepetitionVerdict& verdict : verdicts) {
    double n = 0, mean = 0;
    for (const RepetitionFigure& figure : verdict.repetitions) {
      if (std::isnan(figure.k)) continue;
      ++n;
      mean += (figure.k - mean) / n;
    }
    if (n == 0) continue;
    for (const RepetitionFigure& figure : verdict.repetitions)
      if (!std::isnan(figure.k)) squares += std::pow(figure.k / mean - 1, 2);
    freedom += n - 1;
    if (verdict.occlusion_deg == occlusion_deg) runs += n;
  }
  if (freedom == 0 || runs == 0) return std::numeric_limits<double>::infinity();
  return student_95(freedom) * std::sqrt(squares / freedom / (runs * (runs + 1)));
}

}  // namespace kphi::results
