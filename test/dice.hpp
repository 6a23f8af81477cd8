// Draws from a seed, the same on every machine: the distributions of the standard library are not.
#pragma once

#include <cstdint>
#include <random>

namespace kphi::test {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : generator_(seed) {}
  /// `low` to `high`, both included.
  int whole(int low, int high) {
    return low + static_cast<int>(generator_() % static_cast<std::uint64_t>(high - low + 1));
  }
  double real(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  /// One in `n`.
  bool once_in(int n) { return whole(1, n) == 1; }
  template <class Range>
  const auto& one_of(const Range& range) {
    return range[static_cast<std::size_t>(whole(0, static_cast<int>(std::size(range)) - 1))];
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace kphi::test
