// Watches the thrust of a step while it is held: whether it has settled, and how certain its mean is already.
#pragma once

#include <cstdint>
#include <vector>

namespace kphi::daq {

/// The runner's thread. By the same functions as the reduction: settle() and mean_error().
class StepWatch {
 public:
  /// `discard_s` at the begin of the step is not averaged; it lasts `most_s` at most.
  StepWatch(double discard_s, double most_s) : discard_s_(discard_s), most_s_(most_s) {}

  /// Of the records since the step's begin: their number and their mean thrust, N. `since_s`: time since then. The
  /// first may be those of the phase before: their number falls when the step's own come.
  void add(double since_s, std::uint64_t records, double mean_n);
  /// Mean thrust of the settled part, and its standard uncertainty, N; NaN while it is not settled.
  struct Known {
    double mean_n, u_n;
  };
  [[nodiscard]] Known known() const;

 private:
  static constexpr std::size_t kMostBins = 512;  ///< known() is asked on every tick and must return at once
  double discard_s_, most_s_;
  double bin_s_ = 0.02;  ///< at least; twice as long whenever there are kMostBins
  std::vector<double> bins_;
  double begun_s_ = 0;  ///< of the bin that is being filled
  double sum_ = 0;      ///< of all records up to there, N
  std::uint64_t records_ = 0;
};

}  // namespace kphi::daq
