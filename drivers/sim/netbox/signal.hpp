// From force to counts, 7000 times a second, in the order of the box: saturation, gage bias, filter, units,
// software bias.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/sim/netbox/settings.hpp"

namespace kphi::sim {

/// Hz by code of setuserfilter; 0: off. Not monotonic, as in the manual.
inline constexpr std::array<double, 13> kFilterCutoffsHz{0, 838, 326, 152, 73, 35, 18, 8, 5, 1500, 2000, 2500, 3000};

/// Second-order Butterworth low-pass by the bilinear transform, prewarped; gain 1 at rest. The manual gives a cutoff
/// but no order; second order is an assumption. Begins settled on its first value.
class LowPass {
 public:
  LowPass() = default;  ///< passes everything
  explicit LowPass(double cutoff_hz) noexcept;
  double step(double in) noexcept;

 private:
  double b_ = 1, a1_ = 0, a2_ = 0;
  double s1_ = 0, s2_ = 0;
  bool settled_ = false;
};

class NetBoxSignal {
 public:
  using Counts = std::array<std::int32_t, 6>;

  explicit NetBoxSignal(const NetBoxSettings& settings) noexcept { configure(settings); }
  /// After any change of the settings. A filter restarts when its setting changes.
  void configure(const NetBoxSettings& settings) noexcept;
  /// One internal sample, N and N m.
  void measure(const Wrench& wrench) noexcept;
  void take_software_bias() noexcept;
  /// These axes (bits 0..5) read their full range and are flagged, whatever the load.
  void force_saturation(unsigned axes) noexcept { forced_axes_ = axes; }

  /// These axes (bits 0..5) repeat their present counts.
  void freeze(unsigned axes) noexcept { frozen_axes_ = axes; }

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  [[nodiscard]] bool saturated() const noexcept { return saturation_left_ > 0; }
  /// Counts per SI unit and axis; 0 without a calibration.
  [[nodiscard]] double counts_per_si(std::size_t axis) const noexcept { return scale_[axis]; }

 private:
  bool axia_ = false;
  Wrench range_{};      // N, N m; 0 without a calibration
  Wrench gage_bias_{};  // N, N m
  std::array<double, 6> scale_{};
  int filter_ = 0;
  std::array<LowPass, 6> filters_{};
  std::array<std::int64_t, 6> software_bias_{};  // counts
  Counts counts_{};
  unsigned forced_axes_ = 0, frozen_axes_ = 0;
  int saturation_left_ = 0;  // samples for which the bit stays set
};

}  // namespace kphi::sim
