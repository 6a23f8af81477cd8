// Shuffling that gives the same order from the same seed on every machine: the distributions of the standard library
// draw as each of its makers likes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace kphi::profiles {

/// SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, OOPSLA 2014).
class SplitMix64 {
 public:
  explicit SplitMix64(std::uint64_t seed) : state_(seed) {}
  std::uint64_t operator()() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  /// Uniform in [0, n), n > 0: what would favour the low numbers is drawn again.
  std::uint64_t below(std::uint64_t n) {
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

}  // namespace kphi::profiles
