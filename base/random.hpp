// Random numbers that are the same on every compiler and standard library, unlike the standard's distributions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace kphi {

/// SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, OOPSLA 2014). Any seed will do.
class SplitMix64 {
 public:
  using result_type = std::uint64_t;  // for distributions of others
  static constexpr std::uint64_t min() { return 0; }
  static constexpr std::uint64_t max() { return UINT64_MAX; }
  static constexpr std::uint64_t kGamma = 0x9e3779b97f4a7c15u;

  explicit SplitMix64(std::uint64_t seed) noexcept : state_(seed) {}
  std::uint64_t operator()() noexcept {
    std::uint64_t z = state_ += kGamma;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// Uniform in [0, n), n > 0: a draw that would favour the low numbers is repeated.
  std::uint64_t below(std::uint64_t n) noexcept {
    const std::uint64_t favoured = (0 - n) % n;
    std::uint64_t drawn = (*this)();
    while (drawn < favoured) drawn = (*this)();
    return drawn % n;
  }

 private:
  std::uint64_t state_;
};

/// Fisher-Yates.
template <class T>
void shuffle(std::vector<T>& items, SplitMix64& draw) {
  for (std::size_t left = items.size(); left > 1; --left) std::swap(items[left - 1], items[draw.below(left)]);
}

/// xoshiro256++ 1.0 (Blackman, Vigna; public domain), seeded through SplitMix64.
class Random {
 public:
  explicit Random(std::uint64_t seed) noexcept {
    SplitMix64 draw(seed);
    for (auto& word : state_) word = draw();
  }

  std::uint64_t bits() noexcept {
    const std::uint64_t result = rotated(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t t = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= t;
    state_[3] = rotated(state_[3], 45);
    return result;
  }

  /// Nearly normal, mean 0, deviation 1: the sum of eight 16-bit uniforms. Bounded by ±4.9, excess kurtosis -0.15.
  double normal() noexcept {
    // Variance of the sum of eight discrete uniforms on 0..65535: 8 (2^32 - 1)/12.
    constexpr double kScale = 1.0 / 53509.91992145008;
    return static_cast<double>(sum_of_lanes(bits()) + sum_of_lanes(bits()) - kMeanOfEight) * kScale;
  }

  /// Uniform in [-1, 1).
  double symmetric() noexcept { return static_cast<double>(static_cast<std::int64_t>(bits()) >> 11) * 0x1p-52; }

 private:
  static constexpr std::int64_t kMeanOfEight = std::int64_t{4} * 65535;

  static constexpr std::uint64_t rotated(std::uint64_t x, int by) noexcept { return (x << by) | (x >> (64 - by)); }
  static constexpr std::int64_t sum_of_lanes(std::uint64_t x) noexcept {
    constexpr std::uint64_t kEvenLanes = 0x0000ffff0000ffffull;
    const std::uint64_t pairs = (x & kEvenLanes) + ((x >> 16) & kEvenLanes);
    return static_cast<std::int64_t>((pairs & 0xffffffffull) + (pairs >> 32));
  }

  std::array<std::uint64_t, 4> state_{};
};

}  // namespace kphi
