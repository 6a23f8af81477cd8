// Numbers from a seed, the same on every machine: the standard's generators are, its distributions are not.
#pragma once

#include <cmath>
#include <cstdint>

#include "base/random.hpp"
#include "compensation/units.hpp"

namespace kphi::flight {

/// SplitMix64 with Box and Muller's normal numbers.
class Random {
 public:
  explicit Random(std::uint64_t seed) noexcept : draw_(seed) {}
  /// Of stream `stream` of `seed`: no stream depends on how many numbers another one took.
  Random(std::uint64_t seed, std::uint64_t stream) noexcept
      : draw_(SplitMix64(seed)() ^ (stream * SplitMix64::kGamma + SplitMix64::kGamma)) {}

  [[nodiscard]] std::uint64_t bits() noexcept { return draw_(); }
  /// In [from, to).
  [[nodiscard]] double uniform(double from, double to) noexcept {
    return from + (to - from) * static_cast<double>(bits() >> 11) * 0x1p-53;
  }
  [[nodiscard]] double normal(double mean, double deviation) noexcept {
    if (spare_) {
      spare_ = false;
      return mean + deviation * spare_value_;
    }
    const double radius = std::sqrt(-2 * std::log(1 - uniform(0, 1))), angle = uniform(0, 2 * kPi);
    spare_ = true;
    spare_value_ = radius * std::sin(angle);
    return mean + deviation * radius * std::cos(angle);
  }

 private:
  SplitMix64 draw_;
  double spare_value_ = 0;
  bool spare_ = false;
};

}  // namespace kphi::flight
