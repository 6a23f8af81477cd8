// Units at boundaries. A Quantity is a number that remembers what it measures; SI inside, and RPM, degrees,
// gram-force and N/RPM² exist only as named ways in and out. No conversion happens by itself.
#pragma once

#include <cstdint>
#include <cstring>

namespace kphi {

/// What the library that flies computes with: double, or float where the processor knows no more (KPHI_FLOAT, which the
/// library and all that include it must agree on: it is part of Quantity's name, so the linker finds who does not).
#ifdef KPHI_FLOAT
using Real = float;
#else
using Real = double;
#endif

/// By its bits: a compiler with -ffast-math takes it that there is no NaN, and leaves out what compares for it.
[[nodiscard]] inline bool is_nan(const float& value) noexcept {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return (bits & 0x7FFFFFFFu) > 0x7F800000u;
}
[[nodiscard]] inline bool is_nan(const double& value) noexcept {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return (bits & 0x7FFFFFFFFFFFFFFFu) > 0x7FF0000000000000u;
}
/// Neither NaN nor infinite, by its bits.
[[nodiscard]] inline bool is_finite(const float& value) noexcept {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return (bits & 0x7F800000u) != 0x7F800000u;
}
[[nodiscard]] inline bool is_finite(const double& value) noexcept {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return (bits & 0x7FF0000000000000u) != 0x7FF0000000000000u;
}
/// Finite and above 0, by its bits.
[[nodiscard]] inline bool is_positive(const float& value) noexcept {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits - 1 < 0x7F7FFFFFu;
}
[[nodiscard]] inline bool is_positive(const double& value) noexcept {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits - 1 < 0x7FEFFFFFFFFFFFFFu;
}

inline constexpr Real kPi = Real(3.14159265358979323846);

namespace literals {
/// A number in Real: 0.045_si is no double where Real is float.
[[nodiscard]] constexpr Real operator""_si(long double value) noexcept { return static_cast<Real>(value); }
}  // namespace literals

/// A number with a unit. `value()` is in the SI unit that the alias below names.
template <class Unit, class Number = Real>
class Quantity {
 public:
  constexpr Quantity() noexcept = default;
  constexpr explicit Quantity(Number value) noexcept : value_(value) {}
  [[nodiscard]] constexpr Number value() const noexcept { return value_; }

  friend constexpr Quantity operator+(Quantity a, Quantity b) noexcept { return Quantity(a.value_ + b.value_); }
  friend constexpr Quantity operator-(Quantity a, Quantity b) noexcept { return Quantity(a.value_ - b.value_); }
  friend constexpr Quantity operator-(Quantity a) noexcept { return Quantity(-a.value_); }
  friend constexpr Quantity operator*(Quantity a, Number scale) noexcept { return Quantity(a.value_ * scale); }
  friend constexpr Quantity operator*(Number scale, Quantity a) noexcept { return Quantity(scale * a.value_); }
  friend constexpr Quantity operator/(Quantity a, Number scale) noexcept { return Quantity(a.value_ / scale); }
  friend constexpr Number operator/(Quantity a, Quantity b) noexcept { return a.value_ / b.value_; }
  friend constexpr bool operator==(Quantity a, Quantity b) noexcept { return a <= b && a >= b; }
  friend constexpr bool operator!=(Quantity a, Quantity b) noexcept { return !(a == b); }
  friend constexpr bool operator<(Quantity a, Quantity b) noexcept { return a.value_ < b.value_; }
  friend constexpr bool operator>(Quantity a, Quantity b) noexcept { return a.value_ > b.value_; }
  friend constexpr bool operator<=(Quantity a, Quantity b) noexcept { return a.value_ <= b.value_; }
  friend constexpr bool operator>=(Quantity a, Quantity b) noexcept { return a.value_ >= b.value_; }

 private:
  Number value_ = 0;
};

using Newtons = Quantity<struct NewtonUnit>;                       ///< N
using NewtonMetres = Quantity<struct NewtonMetreUnit>;             ///< N m
using RadPerSec = Quantity<struct RadPerSecUnit>;                  ///< rad/s
using Radians = Quantity<struct RadianUnit>;                       ///< rad
using ThrustCoefficient = Quantity<struct ThrustCoefficientUnit>;  ///< N/(rad/s)²
using Seconds = Quantity<struct SecondUnit>;                       ///< s
using Metres = Quantity<struct MetreUnit>;                         ///< m
using Volts = Quantity<struct VoltUnit>;                           ///< V
using Amperes = Quantity<struct AmpereUnit>;                       ///< A
using Celsius = Quantity<struct CelsiusUnit>;                      ///< °C

/// 1 RPM in rad/s.
inline constexpr Real kRadPerSecPerRpm = kPi / 30;

[[nodiscard]] constexpr RadPerSec from_rpm(Real rpm) noexcept { return RadPerSec(rpm * kRadPerSecPerRpm); }
[[nodiscard]] constexpr Real to_rpm(RadPerSec speed) noexcept { return speed.value() / kRadPerSecPerRpm; }
[[nodiscard]] constexpr Radians from_degrees(Real degrees) noexcept { return Radians(degrees * (kPi / 180)); }
[[nodiscard]] constexpr Real to_degrees(Radians angle) noexcept { return angle.value() * (180 / kPi); }
/// 1 gf = 9.80665e-3 N, exactly (CGPM 1901).
[[nodiscard]] constexpr Newtons from_gram_force(Real gram_force) noexcept {
  return Newtons(gram_force * Real(9.80665e-3));
}
/// 1 N/RPM² = (30/π)² N/(rad/s)², about 91.19.
[[nodiscard]] constexpr ThrustCoefficient from_newtons_per_rpm2(Real k) noexcept {
  return ThrustCoefficient(k / (kRadPerSecPerRpm * kRadPerSecPerRpm));
}
[[nodiscard]] constexpr Real to_newtons_per_rpm2(ThrustCoefficient k) noexcept {
  return k.value() * (kRadPerSecPerRpm * kRadPerSecPerRpm);
}

/// T = k ω² (paper, equations 2 and 3).
[[nodiscard]] constexpr Newtons thrust_at(ThrustCoefficient k, RadPerSec speed) noexcept {
  return Newtons(k.value() * speed.value() * speed.value());
}

}  // namespace kphi
