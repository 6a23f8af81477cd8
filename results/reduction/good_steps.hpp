// Which steps count, how certain their thrust is, and groups of them.
#pragma once

#include <map>
#include <span>
#include <type_traits>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::results {

/// True for a measured thrust without a flag that concerns k (kHarmlessFlags do not).
[[nodiscard]] bool is_good(const StepMean& step);
/// Standard uncertainty of the thrust from the noise within the step, N.
[[nodiscard]] double thrust_u_within(const StepMean& step);

/// Standard uncertainty of the thrust at this speed, N: from the samples and from the uncertainty of the speed.
[[nodiscard]] double thrust_u(const StepMean& step);

using StepGroup = std::vector<const StepMean*>;
/// Steps of the same key, in the order of first appearance.
template <class Key>
std::vector<StepGroup> groups_of(std::span<const StepMean> steps, Key key_of) {
  std::vector<StepGroup> groups;
  std::map<std::invoke_result_t<Key, const StepMean&>, std::size_t> places;
  for (const StepMean& step : steps) {
    const auto [place, is_new] = places.try_emplace(key_of(step), groups.size());
    if (is_new) groups.emplace_back();
    groups[place->second].push_back(&step);
  }
  return groups;
}

}  // namespace kphi::results
