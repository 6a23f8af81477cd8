#include "drivers/netbox/receive/bias.hpp"

#include <cmath>

#include "drivers/netbox/wire/status.hpp"

namespace kphi::netbox {
void ZeroEstimate::add(const StampedRecord& stamped) noexcept {
  if (!healthy(stamped.record.status)) {
    ++refused_;
    return;
  }
  if (records_++ == 0) first_ = stamped.arrival;
  last_ = stamped.arrival;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double difference = stamped.record.counts[axis] - mean_[axis];
    mean_[axis] += difference / static_cast<double>(records_);
    squares_[axis] += difference * (stamped.record.counts[axis] - mean_[axis]);
  }
}

ZeroMeasurement ZeroEstimate::result(const Configuration& scale) const noexcept {
  ZeroMeasurement zero;
  zero.records = records_;
  zero.refused = refused_;
  zero.first = first_;
  zero.last = last_;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double counts_per_unit = axis < 3 ? scale.counts_per_newton : scale.counts_per_newton_metre;
    zero.mean[axis] = mean_[axis] / counts_per_unit;
    if (records_ > 1)
      zero.standard_deviation[axis] = std::sqrt(squares_[axis] / static_cast<double>(records_ - 1)) / counts_per_unit;
  }
  return zero;
}

}  // namespace kphi::netbox
