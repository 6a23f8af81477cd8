// What has a time of arrival, in its order; things of the same time in the order in which they were added. Places are
// used again: nothing is allocated once there are enough.
#pragma once

#include <cstdint>
#include <deque>
#include <iterator>
#include <utility>
#include <vector>

#include "drivers/clock.hpp"

namespace kphi::sim {

template <class Thing>
class UnderWay {
 public:
  void add(const Thing& thing, Instant due) {
    if (free_.empty()) {
      free_.push_back(static_cast<std::uint32_t>(things_.size()));
      things_.emplace_back();
    }
    const std::uint32_t place = free_.back();
    free_.pop_back();
    things_[place] = thing;
    auto behind = order_.end();
    while (behind != order_.begin() && std::prev(behind)->first > due) --behind;
    order_.insert(behind, {due, place});
  }
  /// kNever when there is nothing.
  [[nodiscard]] Instant next() const noexcept { return order_.empty() ? kNever : order_.front().first; }
  /// Only when there is one; until the next add().
  [[nodiscard]] const Thing& first() const noexcept { return things_[order_.front().second]; }
  void drop_first() {
    free_.push_back(order_.front().second);
    order_.pop_front();
  }

 private:
  std::deque<std::pair<Instant, std::uint32_t>> order_;
  std::vector<Thing> things_;
  std::vector<std::uint32_t> free_;
};

}  // namespace kphi::sim
