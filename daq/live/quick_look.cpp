#include "daq/live/quick_look.hpp"

#include <cmath>
#include <limits>

namespace kphi::daq::live {

QuickLook::Look QuickLook::mean(std::size_t begin, std::size_t end) const {
  Look sum{0, 0};
  for (std::size_t i = begin; i < end; ++i) {
    sum.thrust_n += looks_[i].thrust_n;
    sum.speed_squared += looks_[i].speed_squared;
  }
  const auto n = static_cast<double>(end - begin);
  return {sum.thrust_n / n, sum.speed_squared / n};
}

QuickLook::Result QuickLook::result() const {
  const std::size_t n = looks_.size();
  if (n == 0) return {};
  const Look whole = mean(0, n);
  Result result{n, whole.thrust_n, std::sqrt(whole.speed_squared), whole.thrust_n / whole.speed_squared,
                std::numeric_limits<double>::quiet_NaN()};
  if (n < 2 * kBlocks) return result;
  // Means of successive blocks: what is correlated within a block counts once.
  double sum = 0;
  for (std::size_t block = 0; block < kBlocks; ++block) {
    const Look part = mean(block * n / kBlocks, (block + 1) * n / kBlocks);
    const double off = part.thrust_n / part.speed_squared - result.k;
    sum += off * off;
  }
  result.u_k = std::sqrt(sum / (kBlocks * (kBlocks - 1)));
  return result;
}

}  // namespace kphi::daq::live
