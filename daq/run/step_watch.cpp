#include "daq/run/step_watch.hpp"

#include <cmath>
#include <limits>
#include <span>

#include "results/reduction/bin_statistics.hpp"

namespace kphi::daq {

void StepWatch::add(double since_s, std::uint64_t records, double mean_n) {
  if (records < records_) *this = StepWatch(discard_s_, most_s_);  // what came before was of the phase before
  if (records <= records_ || since_s < begun_s_ + bin_s_) return;
  const double sum = static_cast<double>(records) * mean_n;
  bins_.push_back((sum - sum_) / static_cast<double>(records - records_));
  sum_ = sum;
  records_ = records;
  begun_s_ = since_s;
  if (bins_.size() < kMostBins) return;
  for (std::size_t i = 0; i < kMostBins / 2; ++i) bins_[i] = 0.5 * (bins_[2 * i] + bins_[2 * i + 1]);
  bins_.resize(kMostBins / 2);
  bin_s_ *= 2;
}

namespace {

/// Whether the two halves differ by more than noise without memory makes them. A transient shows so before there is a
/// quiet end of the step to hold it against; noise that remembers does, too, and is held longer.
bool halves_agree(std::span<const double> window) {
  const std::size_t half = window.size() / 2;
  double first = 0, second = 0, squares = 0;
  for (std::size_t i = 0; i < half; ++i) {
    first += window[i] / static_cast<double>(half);
    second += window[window.size() - 1 - i] / static_cast<double>(half);
  }
  for (std::size_t i = 1; i < window.size(); ++i)
    squares += std::pow(window[i] - window[i - 1], 2) / (2 * static_cast<double>(window.size() - 1));
  const double u = std::sqrt(2 * squares / static_cast<double>(half));
  return std::abs(second - first) < 3 * u + results::kSteadyShare * std::abs(second);
}

}  // namespace

StepWatch::Known StepWatch::known() const {
  constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
  if (bins_.empty()) return {kNotKnown, kNotKnown};
  const double bin_s = begun_s_ / static_cast<double>(bins_.size());
  const auto first = static_cast<std::size_t>(std::ceil(discard_s_ / bin_s));
  const auto planned = static_cast<std::size_t>(std::max(0.0, (most_s_ - discard_s_) / bin_s));
  const auto least = static_cast<std::size_t>(std::ceil(results::kLeastWindow / bin_s));
  if (bins_.size() < first + std::max(least, results::kLeastValues)) return {kNotKnown, kNotKnown};
  const results::Settling settled = results::settle(bins_, first, planned, bin_s);
  if (!settled.settled) return {kNotKnown, kNotKnown};
  const auto window = std::span(bins_).subspan(settled.begin);
  if (!halves_agree(window)) return {kNotKnown, kNotKnown};
  const results::MeanError level = results::mean_error(results::without_trend(window), 2);
  double mean = 0;
  for (const double bin : window) mean += bin / static_cast<double>(window.size());
  return {mean, level.u};
}

}  // namespace kphi::daq
