#include "drivers/netbox/receive/range_watch.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::netbox {
namespace {

RangeVerdict judge(double load) noexcept {
  if (load > 1.1) return RangeVerdict::trip;
  if (load >= 1.0) return RangeVerdict::beyond;
  return load > 0.8 ? RangeVerdict::near : RangeVerdict::inside;
}

}  // namespace

RangeWatch::RangeWatch(const Configuration& configuration) noexcept {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double counts_per_unit = axis < 3 ? configuration.counts_per_newton : configuration.counts_per_newton_metre;
    full_scale_[axis] = counts_per_unit * configuration.range[axis];
  }
}

RangeVerdict RangeWatch::look(const Record& record) noexcept {
  double load = 0;
  int loaded_axis = 0;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double its_load = std::abs(static_cast<double>(record.counts[axis])) / full_scale_[axis];
    if (its_load <= load) continue;
    load = its_load;
    loaded_axis = static_cast<int>(axis);
  }
  const RangeVerdict verdict = judge(load);
  ++counts_[static_cast<std::size_t>(verdict)];
  worst_ = std::max(worst_, verdict);
  if (load > largest_load_) {
    largest_load_ = load;
    worst_axis_ = loaded_axis;
  }
  return verdict;
}

void RangeWatch::reset() noexcept {
  worst_ = RangeVerdict::inside;
  worst_axis_ = 0;
  largest_load_ = 0;
  counts_ = {};
}

}  // namespace kphi::netbox
