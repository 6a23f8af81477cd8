#include "profiles/order.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/random.hpp"

namespace kphi::profiles {
namespace {

// In the order of the enumerators; the schema lists the same words.
constexpr std::array<const char*, 2> kRunOrders{"listed", "shuffled"};
constexpr std::array<const char*, 4> kStepOrders{"up", "down", "shuffled", "up_and_down"};

template <class Kind, std::size_t n>
Kind kind_of(const std::array<const char*, n>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), std::string_view(name));
  return static_cast<Kind>(found == names.end() ? 0 : found - names.begin());
}

}  // namespace

RunOrderKind run_order_from(const std::string& name) { return kind_of<RunOrderKind>(kRunOrders, name); }
StepOrderKind step_order_from(const std::string& name) { return kind_of<StepOrderKind>(kStepOrders, name); }
const char* name_of(RunOrderKind kind) { return kRunOrders[static_cast<std::size_t>(kind)]; }
const char* name_of(StepOrderKind kind) { return kStepOrders[static_cast<std::size_t>(kind)]; }

std::vector<PlannedStep> steps_in_order(const std::vector<RadPerSec>& levels, StepOrderKind kind,
                                        std::uint64_t run_seed) {
  std::vector<PlannedStep> steps;
  for (std::size_t i = 0; i < levels.size(); ++i) steps.push_back({static_cast<int>(i), levels[i]});
  if (kind == StepOrderKind::down) std::reverse(steps.begin(), steps.end());
  if (kind == StepOrderKind::shuffled) {
    SplitMix64 draw(run_seed);
    shuffle(steps, draw);
  }
  if (kind == StepOrderKind::up_and_down) {
    for (std::size_t i = levels.size() - 1; i-- > 0;) steps.push_back({static_cast<int>(steps.size()), levels[i]});
  }
  return steps;
}

std::string to_words(const Order& order) {
  const bool seeded = order.runs == RunOrderKind::shuffled || order.steps == StepOrderKind::shuffled;
  return fmt::format("runs {}, steps {}{}{}{}", name_of(order.runs), name_of(order.steps),
                     seeded ? fmt::format(" (seed {})", order.seed) : "",
                     order.remount_each_repetition ? ", remounted for each repetition" : "",
                     order.reference ? ", reference runs first and last" : "");
}

}  // namespace kphi::profiles
