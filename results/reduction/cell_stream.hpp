// The load cell of one run, with its samples placed in bench time and summed in bins of equal length. The sums are
// integers: counts about an origin, and their squares. So any order of adding, any number of threads and any division
// into bins gives the same sums, and the same bytes in steps.csv.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "results/load_cell_columns.hpp"
#include "results/reduction/clock_map.hpp"

namespace kphi::results {

__extension__ using Wide = __int128;

/// Of one axis, about an origin.
struct CountSums {
  std::int64_t sum = 0;
  Wide squares = 0;
  void add(std::span<const std::int32_t> counts, std::int32_t origin);
  void add(const CountSums& other) {
    sum += other.sum;
    squares += other.squares;
  }
};

struct CellBin {
  CountSums force, torque;
  std::uint32_t n = 0;
  std::uint32_t status = 0;           ///< all set bits, without healthy monitor words
  bool at_limit = false;              ///< a count of some axis at the end of its range
  [[nodiscard]] bool frozen() const;  ///< more than one sample, and no force differs
};

/// Mean and deviation of one axis, counts; NaN and 0 without samples.
struct CountMean {
  double mean = 0;
  double deviation = 0;
};

/// What was measured within whole bins.
struct CellWindow {
  std::uint64_t n = 0;
  CountMean force, torque;
  std::uint64_t lost = 0;
  std::uint32_t status = 0;
  bool at_limit = false;
  bool frozen = false;  ///< one value repeated for kFrozenSpan
};

/// Bit for bit the same force and torque for this long is not a measurement, s.
inline constexpr double kFrozenSpan = 0.1;

/// The samples of one window in bins of equal length; an incomplete last bin is left out.
class CellBins {
 public:
  [[nodiscard]] std::size_t size() const { return bins_.size(); }
  [[nodiscard]] double bin_s() const { return 1e-9 * static_cast<double>(width_); }
  [[nodiscard]] Nanoseconds width() const { return width_; }
  /// Of bins [first, last).
  [[nodiscard]] Window window(std::size_t first, std::size_t last) const;
  /// The first bin that begins at `time` or later; size() if none does.
  [[nodiscard]] std::size_t first_from(Nanoseconds time) const;
  /// Mean counts of the force; NaN of a bin that holds less than half of its samples.
  [[nodiscard]] double force(std::size_t bin) const;
  [[nodiscard]] CellWindow over(std::size_t first, std::size_t last) const;

 private:
  friend class CellStream;
  /// Records missing between two others by ft_sequence: at before + k · period, k = 1…missing.
  struct Gap {
    double before_ns = 0;
    double period_ns = 0;
    std::uint32_t missing = 0;
    [[nodiscard]] double up_to(double time_ns) const;
  };
  Nanoseconds begin_ = 0;
  Nanoseconds width_ = 1;
  double expected_ = 0;  ///< samples per bin
  std::int32_t force_origin_ = 0, torque_origin_ = 0;
  std::vector<CellBin> bins_;
  std::vector<Gap> gaps_;
};

/// Evenly spaced samples of the thrust axis; a missing one repeats the sample before it.
struct EvenSamples {
  double rate_hz = 0;          ///< by the clock of the box
  std::vector<double> counts;  ///< empty: no samples, or the box restarted or stalled within the window
};

class CellStream {
 public:
  /// The recording and its columns must outlive the stream.
  CellStream(const RunRecording& run, const LoadCellColumns& cell);

  /// Number of restarts of the box before `time`.
  [[nodiscard]] std::size_t boot_at(Nanoseconds time) const;
  /// The part of a window after the last restart of the box in it.
  [[nodiscard]] Window since_reboot(Window window) const;
  [[nodiscard]] CellBins bins(const Window& window) const;
  [[nodiscard]] EvenSamples samples(const Window& window) const;

 private:
  [[nodiscard]] std::uint32_t advance_to(std::size_t i) const {
    return cell_.ft_sequence[i] - cell_.ft_sequence[i - 1];
  }
  /// Adds records [from, to).
  void add(std::size_t from, std::size_t to, CellBins& bins, CellBin& bin) const;
  void take_gaps(const ClockEpoch& epoch, std::size_t begin, std::size_t end, CellBins& bins) const;

  const RunHeader& header_;
  const LoadCellColumns& cell_;
  ClockMap clock_;
  std::vector<Nanoseconds> reboots_;
};

}  // namespace kphi::results
