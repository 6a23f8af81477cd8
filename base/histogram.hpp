// How long things took: a histogram of durations.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "base/clock.hpp"

namespace kphi {

/// Quantiles of delays from 0 to hours, each at most 12.5 % too high. Integers only, a few nanoseconds per value.
class DelayHistogram {
 public:
  /// Negative delays count as zero.
  void add(Duration delay) noexcept {
    const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(0, delay.count()));
    ++counts_[class_of(ns)];
    ++total_;
  }
  [[nodiscard]] std::uint64_t total() const noexcept { return total_; }
  /// The `share` (0..1) of all delays is not above it; 0 when there is none.
  [[nodiscard]] Duration quantile(double share) const noexcept {
    auto left = static_cast<std::uint64_t>(share * static_cast<double>(total_));
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (counts_[i] > left) return Duration(static_cast<std::int64_t>(upper_end(i)));
      left -= counts_[i];
    }
    return Duration{0};
  }
  /// Those that came after `earlier`, a copy of this one.
  [[nodiscard]] DelayHistogram since(const DelayHistogram& earlier) const noexcept {
    DelayHistogram later = *this;
    for (std::size_t i = 0; i < counts_.size(); ++i) later.counts_[i] -= earlier.counts_[i];
    later.total_ -= earlier.total_;
    return later;
  }

 private:
  // Eight classes for each power of two.
  static std::size_t class_of(std::uint64_t ns) noexcept {
    if (ns < 8) return ns;
    const auto power = static_cast<std::size_t>(std::bit_width(ns)) - 4;
    return std::min<std::size_t>(8 * power + (ns >> power), kClasses - 1);
  }
  static std::uint64_t upper_end(std::size_t index) noexcept {
    if (index < 16) return index;
    const std::size_t power = index / 8 - 1;
    return ((index - 8 * power + 1) << power) - 1;
  }

  static constexpr std::size_t kClasses = std::size_t{8} * 44;
  std::array<std::uint64_t, kClasses> counts_{};
  std::uint64_t total_ = 0;
};

}  // namespace kphi
