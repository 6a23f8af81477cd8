// The zero of the load cell: mean and spread of what it shows without load.
#pragma once

#include <array>
#include <cstdint>

#include "base/clock.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/stream/sequence.hpp"

namespace kphi::netbox {

/// Fx Fy Fz in N, Tx Ty Tz in Nm.
struct ZeroMeasurement {
  std::array<double, 6> mean{};
  std::array<double, 6> standard_deviation{};  ///< of one record
  std::uint64_t records = 0;
  std::uint64_t refused = 0;  ///< saturated or faulty, left out
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

/// Largest mean left after the box's own bias.
struct BiasTolerance {
  double force_n = 0.05;
  double torque_nm = 0.002;
};

}  // namespace kphi::netbox
