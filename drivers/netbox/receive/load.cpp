#include "drivers/netbox/receive/load.hpp"

#include <cmath>

namespace kphi::netbox {

void ZeroEstimate::add(const Counts& counts, std::uint32_t status) noexcept {
  if (!healthy(status)) return;
  ++records_;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double difference = counts[axis] - mean_[axis];
    mean_[axis] += difference / static_cast<double>(records_);
    squares_[axis] += difference * (counts[axis] - mean_[axis]);
  }
}

ZeroMeasurement ZeroEstimate::result(const CellScale& scale) const noexcept {
  ZeroMeasurement zero;
  zero.records = records_;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double counts_per_unit = scale.counts_per_unit[axis];
    if (!(counts_per_unit > 0)) continue;
    zero.mean[axis] = mean_[axis] / counts_per_unit;
    if (records_ > 1)
      zero.standard_deviation[axis] = std::sqrt(squares_[axis] / static_cast<double>(records_ - 1)) / counts_per_unit;
  }
  return zero;
}

RangeWatch::RangeWatch(const CellScale& scale) noexcept {
  for (std::size_t axis = 0; axis < 6; ++axis) full_scale_[axis] = scale.counts_per_unit[axis] * scale.range[axis];
}

RangeVerdict RangeWatch::look(const Counts& counts) noexcept {
  double load = 0;
  int loaded_axis = 0;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    if (!(full_scale_[axis] > 0)) continue;
    const double its_load = std::abs(static_cast<double>(counts[axis])) / full_scale_[axis];
    if (its_load <= load) continue;
    load = its_load;
    loaded_axis = static_cast<int>(axis);
  }
  if (load > largest_load_) {
    largest_load_ = load;
    worst_axis_ = loaded_axis;
  }
  if (load >= 1.0) return RangeVerdict::beyond;
  return load > 0.8 ? RangeVerdict::near : RangeVerdict::inside;
}

}  // namespace kphi::netbox
