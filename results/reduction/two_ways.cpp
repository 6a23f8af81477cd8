#include "results/reduction/two_ways.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/statistics.hpp"
#include "compensation/units.hpp"
#include "results/reduction/good_steps.hpp"

namespace kphi::results {

namespace {

struct Pair {
  const StepMean* up = nullptr;
  const StepMean* down = nullptr;
};

/// The profile's own way comes first, and it rises when its first step is not its fastest.
bool rises(std::span<const StepMean> run) {
  const auto first = std::ranges::min_element(run, {}, &StepMean::step);
  return std::ranges::any_of(
      run, [&](const StepMean& step) { return step.commanded_speed_rad_s > first->commanded_speed_rad_s; });
}

/// By commanded speed, of those that were held twice.
std::map<double, Pair> pairs_of(std::span<const StepMean> run) {
  std::map<double, std::vector<const StepMean*>> by_level;
  for (const StepMean& step : run) {
    if (is_good(step)) by_level[step.commanded_speed_rad_s].push_back(&step);
  }
  std::map<double, Pair> pairs;
  for (const auto& [level, steps] : by_level) {
    if (steps.size() != 2) continue;
    const bool in_order = (steps[0]->step < steps[1]->step) == rises(run);
    pairs[level] = in_order ? Pair{steps[0], steps[1]} : Pair{steps[1], steps[0]};
  }
  return pairs;
}

}  // namespace

std::string Hysteresis::to_words() const {
  const auto largest = std::ranges::max_element(speeds, {}, [](const auto& p) { return std::abs(p.up_minus_down_n); });
  const auto beyond = std::ranges::count_if(speeds, [](const auto& p) { return p.significant(); });
  return fmt::format(
      "thrust going up minus going down: {:+.3f} ± {:.3f} % of k{}; at most {:+.4f} ± {:.4f} N at {:.0f} RPM; {} of {} "
      "speeds beyond twice their uncertainty",
      100 * share, 100 * u_share, significant() ? "" : ", no hysteresis seen", largest->up_minus_down_n, largest->u_n,
      to_rpm(RadPerSec(largest->speed_rad_s)), beyond, speeds.size());
}

std::optional<Hysteresis> hysteresis_of(std::span<const StepMean> run) {
  Hysteresis found;
  double difference = 0, thrust = 0, weight = 0, variance = 0;
  for (const auto& [level, pair] : pairs_of(run)) {
    const double x = square(pair.up->speed_rad_s);
    const double scale = x / square(pair.down->speed_rad_s);
    const double down = pair.down->thrust_n * scale;
    const double u = std::hypot(thrust_u(*pair.up), scale * thrust_u(*pair.down));
    found.speeds.push_back({pair.up->speed_rad_s, pair.up->thrust_n - down, u});
    difference += x * found.speeds.back().up_minus_down_n;
    thrust += x * 0.5 * (pair.up->thrust_n + down);
    weight += x * x;
    variance += square(x * u);
  }
  if (found.speeds.size() < 2 || !(thrust > 0)) return std::nullopt;
  const double k = thrust / weight;
  found.share = difference / weight / k;
  found.u_share = std::sqrt(variance) / weight / k;
  return found;
}

}  // namespace kphi::results
