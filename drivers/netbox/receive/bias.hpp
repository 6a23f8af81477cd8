// The zero of the load cell as a measured step: what it shows without load, with its spread, and the box's own bias
// verified by measuring again.
#pragma once

#include <array>
#include <cstdint>

#include "base/clock.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/receive/load_cell.hpp"

namespace kphi::netbox {

/// Fx Fy Fz in N, Tx Ty Tz in Nm.
struct ZeroMeasurement {
  std::array<double, 6> mean{};
  std::array<double, 6> standard_deviation{};  ///< of one record
  std::uint64_t records = 0;
  std::uint64_t refused = 0;  ///< saturated or faulty ones, left out
  Instant first{0}, last{0};  ///< arrivals
};

/// Mean and standard deviation (n - 1) as the records come. One thread.
class ZeroEstimate {
 public:
  void add(const StampedRecord& stamped) noexcept;
  [[nodiscard]] std::uint64_t records() const noexcept { return records_; }
  [[nodiscard]] ZeroMeasurement result(const Configuration& scale) const noexcept;

 private:
  std::array<double, 6> mean_{}, squares_{};  // counts
  std::uint64_t records_ = 0, refused_ = 0;
  Instant first_{0}, last_{0};
};

struct BiasTolerance {
  double force_n = 0.05;
  double torque_nm = 0.002;
};

struct BiasStep {
  ZeroMeasurement before, after;
  int draws = 0;                  ///< biases sent until one was good
  bool stream_restarted = false;  ///< this box stops its stream for a bias
};

/// Mean of the next `records` records. Takes them from the stream: nobody else may take meanwhile. Throws DeviceError
/// when they do not come within `wall_timeout`.
[[nodiscard]] ZeroMeasurement measure_zero(LoadCell& cell, std::uint64_t records,
                                           std::chrono::nanoseconds wall_timeout);

/// Measures, sends the box's bias (0x42), waits until it can have worked, measures again. The box takes one noisy
/// sample as its zero: a bad draw is drawn again, three in all. Throws DeviceError when the mean of an axis is then
/// still not within `tolerance`; the load must be at rest. Each measurement has `wall_timeout`.
[[nodiscard]] BiasStep take_bias(LoadCell& cell, const Clock& clock, std::uint64_t records, BiasTolerance tolerance,
                                 std::chrono::nanoseconds wall_timeout);

}  // namespace kphi::netbox
