#include "daq/guard/load_watch.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::daq {

LoadWatch::LoadWatch(const Mounting& mounting, const results::LoadCellScale& scale)
    : mounting_(mounting),
      counts_per_newton_(scale.counts_per_newton),
      counts_per_newton_metre_(scale.counts_per_newton_metre),
      sums_(static_cast<std::size_t>(std::max(1.0, std::round(kWindow * scale.sample_rate_hz)))) {}

void LoadWatch::add(const results::LoadCellRecord& record) noexcept {
  last_[samples_++ % last_.size()] = record.counts;
  if (samples_ < last_.size()) return;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const auto [a, b, c] = std::array{last_[0][axis], last_[1][axis], last_[2][axis]};
    median_[axis] = std::max(std::min(a, b), std::min(std::max(a, b), c));
  }
  const auto axis = static_cast<std::size_t>(mounting_.axis);
  Pair& oldest = sums_[medians_++ % sums_.size()];
  total_.thrust += median_[axis] - oldest.thrust;
  total_.torque += median_[axis + 3] - oldest.torque;
  oldest = {median_[axis], median_[axis + 3]};
}

double LoadWatch::load(std::size_t axis) const noexcept {
  return std::abs(static_cast<double>(median_[axis])) / (axis < 3 ? counts_per_newton_ : counts_per_newton_metre_);
}

double LoadWatch::thrust() const noexcept {
  return mounting_.sign * static_cast<double>(total_.thrust) / (static_cast<double>(sums_.size()) * counts_per_newton_);
}

double LoadWatch::shaft_torque() const noexcept {
  return static_cast<double>(total_.torque) / (static_cast<double>(sums_.size()) * counts_per_newton_metre_);
}

}  // namespace kphi::daq
