// Bench time of the Net Box samples, for the whole program. The only clock of the box is ft_sequence, which counts at
// its own rate; arrival stamps are bench time plus a delay of which only the smallest is steady. Therefore: the
// smallest (arrival - device time) per 0.5 s of device time, and a least-squares line through these over the whole run
// (science.md, eq. 3).
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "results/load_cell_columns.hpp"

namespace kphi::results {

/// Records during which ft_sequence counts without a break: one clock each.
struct ClockEpoch {
  std::size_t begin = 0;  ///< index of the first record
  std::size_t end = 0;    ///< one past the last
  std::uint32_t ft_first = 0;
  double offset_ns = 0;   ///< bench time of the first record
  double skew = 0;        ///< bench ns gained per device ns; 0 below 2 s of records
  bool rebooted = false;  ///< ft_sequence jumped back at the beginning: the box restarted
};

class ClockMap {
 public:
  /// `device_rate_hz`: rate at which ft_sequence counts. The columns, in order of arrival, must outlive the map.
  /// A one-way stream cannot show the constant delays of box, filter and wire: times are late by their smallest sum.
  /// `events`: in a stall the box repeats its measurement and its clock stands still; behind it begins another epoch.
  ClockMap(const LoadCellColumns& cell, double device_rate_hz, std::span<const StreamEvent> events = {});

  [[nodiscard]] const std::vector<ClockEpoch>& epochs() const { return epochs_; }
  /// Bench time of the sample in record `index` of `epoch`. Increases with the index.
  [[nodiscard]] Nanoseconds time_ns(const ClockEpoch& epoch, std::size_t index) const {
    return std::llround(exact_time_of(epoch, ft_[index]));
  }
  /// First record of `epoch` at or after `time`, not before `from`; epoch.end if there is none. Quick near `from`.
  [[nodiscard]] std::size_t first_at(const ClockEpoch& epoch, Nanoseconds time, std::size_t from) const;
  [[nodiscard]] std::size_t first_at(const ClockEpoch& epoch, Nanoseconds time) const {
    return first_at(epoch, time, epoch.begin);
  }

 private:
  /// Since the begin of the epoch.
  [[nodiscard]] double device_ns(const ClockEpoch& epoch, std::uint32_t ft) const {
    return static_cast<double>(ft - epoch.ft_first) * tick_ns_;
  }
  [[nodiscard]] double exact_time_of(const ClockEpoch& epoch, std::uint32_t ft) const;  ///< ns
  std::span<const std::uint32_t> ft_;
  double tick_ns_;
  std::vector<ClockEpoch> epochs_;
};

/// Bench time of the sample in every record, strictly increasing: by the box's clock, where 40 of them share one stamp
/// of arrival. The stamp itself where the rate of the clock is not known.
[[nodiscard]] std::vector<Nanoseconds> sample_times(const RunRecording& run, const LoadCellColumns& cell);
[[nodiscard]] std::vector<Nanoseconds> sample_times(const RunRecording& run);

}  // namespace kphi::results
