// The load cell of one run, with its samples placed in bench time and summed in bins (cell_bin.hpp).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "daq/cell_bin.hpp"
#include "daq/clock_map.hpp"
#include "daq/window.hpp"
#include "results/load_cell_columns.hpp"
#include "results/records.hpp"

namespace kphi::daq {

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
  bool frozen = false;  ///< it repeated one value for kFrozenSpan
};

/// Bit for bit the same force and torque for so long is no measurement, s.
inline constexpr double kFrozenSpan = 0.1;

/// The samples of one window in bins of equal length; the last piece that fills no bin is left out.
class CellBins {
 public:
  [[nodiscard]] std::size_t size() const { return bins_.size(); }
  [[nodiscard]] double bin_s() const { return 1e-9 * static_cast<double>(width_); }
  [[nodiscard]] results::Nanoseconds width() const { return width_; }
  /// Of bins [first, last).
  [[nodiscard]] Window window(std::size_t first, std::size_t last) const;
  /// The first bin that begins at `time` or later; size() when none does.
  [[nodiscard]] std::size_t first_from(results::Nanoseconds time) const;
  /// Mean counts of the force; NaN of a bin that holds less than half of its samples.
  [[nodiscard]] double force(std::size_t bin) const;
  [[nodiscard]] double torque(std::size_t bin) const;
  [[nodiscard]] CellWindow over(std::size_t first, std::size_t last) const;

 private:
  friend class CellStream;
  /// Records that ft_sequence says are missing between two others: at before + k · period, k = 1…missing.
  struct Gap {
    double before_ns = 0;
    double period_ns = 0;
    std::uint32_t missing = 0;
    [[nodiscard]] double up_to(double time_ns) const;
  };
  results::Nanoseconds begin_ = 0;
  results::Nanoseconds width_ = 1;
  double expected_ = 0;  ///< samples per bin
  CountFrame frame_;
  std::vector<CellBin> bins_;
  std::vector<Gap> gaps_;
};

class CellStream {
 public:
  /// The recording must outlive the stream. Without `columns` its records are taken.
  explicit CellStream(const results::RunRecording& run, std::unique_ptr<results::LoadCellColumns> columns = nullptr);

  /// How often the box had started anew before `time`.
  [[nodiscard]] std::size_t boot_at(results::Nanoseconds time) const;
  /// The part of a window after the last restart of the box in it.
  [[nodiscard]] Window since_reboot(Window window) const;
  [[nodiscard]] CellBins bins(const Window& window) const;

 private:
  void take_gaps(const ClockEpoch& epoch, std::size_t begin, std::size_t end, CellBins& bins) const;

  const results::RunHeader& header_;
  std::unique_ptr<results::LoadCellColumns> columns_;
  ClockMap clock_;
  std::vector<std::size_t> gaps_;  ///< records before which ft_sequence says that others are missing
  std::vector<results::Nanoseconds> reboots_;
  CountFrame frame_;
};

}  // namespace kphi::daq
