#include "drivers/netbox/stream/health.hpp"

namespace kphi::netbox {

void HealthMeter::begin() noexcept {
  clock_.restart();
  jitter_.clear();
  records_ = datagrams_ = high_water_ = 0;
}

void HealthMeter::note(const StampedRecord& newest, std::uint64_t records, std::uint64_t reboots) noexcept {
  if (reboots != reboots_) clock_.restart();
  reboots_ = reboots;
  jitter_.add(clock_.add(newest.record.ft_sequence, newest.arrival));
  if (datagrams_++ == 0) {
    first_ = newest.arrival;
  } else {
    records_ += records;
  }
  newest_ = newest.arrival;
}

Health HealthMeter::health() const noexcept {
  Health health;
  const double seconds = to_seconds(newest_ - first_);
  if (datagrams_ > 1 && seconds > 0) {
    health.records_per_second = static_cast<double>(records_) / seconds;
    health.datagrams_per_second = static_cast<double>(datagrams_ - 1) / seconds;
  }
  health.jitter_p50_ns = jitter_.quantile(0.5).count();
  health.jitter_p99_ns = jitter_.quantile(0.99).count();
  health.skew_ppm = clock_.skew_ppm();
  health.clock_uncertainty_ns = clock_.uncertainty().count();
  health.clock_epochs = clock_.epochs();
  health.queue_high_water = high_water_;
  return health;
}

}  // namespace kphi::netbox
