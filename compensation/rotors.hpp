// One value for each rotor of a vehicle with 3 to 8 of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace kphi::compensation {

inline constexpr std::size_t kFewestRotors = 3;
inline constexpr std::size_t kMostRotors = 8;

/// Rotor 0 to size() − 1. Plain data, of the same size for any number of rotors.
template <class T>
class Rotors {
 public:
  constexpr Rotors() noexcept = default;
  /// Of a vehicle with `count` rotors; more than kMostRotors count as that many.
  constexpr explicit Rotors(std::size_t count, const T& each = T()) noexcept
      : values_(filled(each, std::make_index_sequence<kMostRotors>())),
        count_(static_cast<std::uint32_t>(count < kMostRotors ? count : kMostRotors)) {}
  template <std::size_t N>
  constexpr Rotors(const std::array<T, N>& values) noexcept  // NOLINT: the way in
      : values_(padded(values, std::make_index_sequence<kMostRotors>())), count_(N) {
    static_assert(N >= kFewestRotors && N <= kMostRotors, "a vehicle has 3 to 8 rotors");
  }
  template <class... More>
  constexpr Rotors(const T& a, const T& b, const T& c, const More&... more) noexcept
      : Rotors(std::array<T, 3 + sizeof...(More)>{{a, b, c, T(more)...}}) {}

  [[nodiscard]] constexpr std::size_t size() const noexcept { return count_; }
  /// Of so many rotors, kMostRotors at most, the first of them as they are.
  constexpr void resize(std::size_t count) noexcept { count_ = static_cast<std::uint32_t>(count); }
  /// One rotor more; there must be less than kMostRotors.
  constexpr void add(const T& value) noexcept { values_[count_++] = value; }
  [[nodiscard]] constexpr T& operator[](std::size_t i) noexcept { return values_[i]; }
  [[nodiscard]] constexpr const T& operator[](std::size_t i) const noexcept { return values_[i]; }
  [[nodiscard]] constexpr T* begin() noexcept { return values_.data(); }
  [[nodiscard]] constexpr T* end() noexcept { return values_.data() + count_; }
  [[nodiscard]] constexpr const T* begin() const noexcept { return values_.data(); }
  [[nodiscard]] constexpr const T* end() const noexcept { return values_.data() + count_; }

  friend constexpr bool operator==(const Rotors& a, const Rotors& b) noexcept {
    if (a.count_ != b.count_) return false;
    for (std::size_t i = 0; i < a.count_; ++i) {
      if (!(a.values_[i] == b.values_[i])) return false;
    }
    return true;
  }

 private:
  template <std::size_t... I>
  static constexpr std::array<T, kMostRotors> filled(const T& each, std::index_sequence<I...>) noexcept {
    return {{(static_cast<void>(I), each)...}};
  }
  template <std::size_t N, std::size_t... I>
  static constexpr std::array<T, kMostRotors> padded(const std::array<T, N>& values,
                                                     std::index_sequence<I...>) noexcept {
    return {{values[I < N ? I : 0]...}};
  }

  std::array<T, kMostRotors> values_{};
  std::uint32_t count_ = 0;
};

}  // namespace kphi::compensation
