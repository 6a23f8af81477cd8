// Compares each sample with the sensing ranges (cfgmr). Values only; one thread.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/wire/rdt.hpp"

namespace kphi::netbox {

enum class RangeVerdict : std::uint8_t {
  inside,
  near,    ///< above 80 % of a range
  beyond,  ///< at 100 % or more: the sample is to be flagged
  trip,    ///< above 110 %: stop the motor, the cell is in danger
};

class RangeWatch {
 public:
  explicit RangeWatch(const Configuration& configuration) noexcept;

  /// The worst of the six axes.
  RangeVerdict look(const Record& record) noexcept;

  [[nodiscard]] RangeVerdict worst() const noexcept { return worst_; }
  /// Axis (0..5 = Fx..Tz) with the largest load so far, and that load in parts of its range.
  [[nodiscard]] int worst_axis() const noexcept { return worst_axis_; }
  [[nodiscard]] double largest_load() const noexcept { return largest_load_; }
  /// Samples with that verdict.
  [[nodiscard]] std::uint64_t count(RangeVerdict verdict) const noexcept {
    return counts_[static_cast<std::size_t>(verdict)];
  }
  void reset() noexcept;

 private:
  std::array<double, 6> full_scale_{};  // counts
  RangeVerdict worst_ = RangeVerdict::inside;
  int worst_axis_ = 0;
  double largest_load_ = 0;
  std::array<std::uint64_t, 4> counts_{};
};

}  // namespace kphi::netbox
