// What samples say about the load on the cell: its zero, and how near it comes to the sensing ranges. Values only; one
// thread.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/netbox/configuration/configuration.hpp"

namespace kphi::netbox {

using Counts = std::array<std::int32_t, 6>;  ///< Fx Fy Fz Tx Ty Tz

/// Fx Fy Fz in N, Tx Ty Tz in Nm.
struct ZeroMeasurement {
  std::array<double, 6> mean{};
  std::array<double, 6> standard_deviation{};  ///< of one record
  std::uint64_t records = 0;                   ///< without the saturated and faulty ones
};

/// What load a count is, and where the load ends.
struct CellScale {
  std::array<double, 6> counts_per_unit{};  ///< per N and N m
  std::array<double, 6> range{};            ///< N and N m
  CellScale() = default;
  CellScale(const Configuration& box) noexcept : range(box.range) {  // a box's is one
    for (std::size_t axis = 0; axis < 6; ++axis) counts_per_unit[axis] = box.counts_per_unit(axis);
  }
};

/// Mean and standard deviation (n - 1) of what the cell shows without load, as the records come.
class ZeroEstimate {
 public:
  /// Leaves an unhealthy record out.
  void add(const Counts& counts, std::uint32_t status) noexcept;
  [[nodiscard]] ZeroMeasurement result(const CellScale& scale) const noexcept;

 private:
  std::array<double, 6> mean_{}, squares_{};  // counts
  std::uint64_t records_ = 0;
};

/// Largest mean left after the box's own bias.
struct BiasTolerance {
  double force_n = 0.05;
  double torque_nm = 0.002;
};

enum class RangeVerdict : std::uint8_t {
  inside,
  near,    ///< above 80 % of a range
  beyond,  ///< at 100 % or more: the sample is to be flagged
};

/// Compares each sample with the sensing ranges (cfgmr); an axis of range 0 is not judged.
class RangeWatch {
 public:
  explicit RangeWatch(const CellScale& scale) noexcept;

  /// The worst of the six axes.
  RangeVerdict look(const Counts& counts) noexcept;
  /// Axis (0..5 = Fx..Tz) with the largest load so far, and that load in parts of its range.
  [[nodiscard]] int worst_axis() const noexcept { return worst_axis_; }
  [[nodiscard]] double largest_load() const noexcept { return largest_load_; }

 private:
  std::array<double, 6> full_scale_{};  // counts
  int worst_axis_ = 0;
  double largest_load_ = 0;
};

}  // namespace kphi::netbox
