// Units at boundaries. A Quantity is a double that remembers what it measures; SI inside, and RPM, degrees,
// gram-force and N/RPM² exist only as named ways in and out. No conversion happens by itself.
#pragma once

namespace kphi {

inline constexpr double kPi = 3.14159265358979323846;

/// A number with a unit. `value()` is in the SI unit that the alias below names.
template <class Unit>
class Quantity {
 public:
  constexpr Quantity() noexcept = default;
  constexpr explicit Quantity(double value) noexcept : value_(value) {}
  [[nodiscard]] constexpr double value() const noexcept { return value_; }

  friend constexpr Quantity operator+(Quantity a, Quantity b) noexcept { return Quantity(a.value_ + b.value_); }
  friend constexpr Quantity operator-(Quantity a, Quantity b) noexcept { return Quantity(a.value_ - b.value_); }
  friend constexpr Quantity operator-(Quantity a) noexcept { return Quantity(-a.value_); }
  friend constexpr Quantity operator*(Quantity a, double scale) noexcept { return Quantity(a.value_ * scale); }
  friend constexpr Quantity operator*(double scale, Quantity a) noexcept { return Quantity(scale * a.value_); }
  friend constexpr Quantity operator/(Quantity a, double scale) noexcept { return Quantity(a.value_ / scale); }
  friend constexpr double operator/(Quantity a, Quantity b) noexcept { return a.value_ / b.value_; }
  friend constexpr bool operator==(Quantity a, Quantity b) noexcept { return a.value_ == b.value_; }
  friend constexpr bool operator!=(Quantity a, Quantity b) noexcept { return a.value_ != b.value_; }
  friend constexpr bool operator<(Quantity a, Quantity b) noexcept { return a.value_ < b.value_; }
  friend constexpr bool operator>(Quantity a, Quantity b) noexcept { return a.value_ > b.value_; }
  friend constexpr bool operator<=(Quantity a, Quantity b) noexcept { return a.value_ <= b.value_; }
  friend constexpr bool operator>=(Quantity a, Quantity b) noexcept { return a.value_ >= b.value_; }

 private:
  double value_ = 0.0;
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
inline constexpr double kRadPerSecPerRpm = kPi / 30.0;

[[nodiscard]] constexpr RadPerSec from_rpm(double rpm) noexcept { return RadPerSec(rpm * kRadPerSecPerRpm); }
[[nodiscard]] constexpr double to_rpm(RadPerSec speed) noexcept { return speed.value() / kRadPerSecPerRpm; }
[[nodiscard]] constexpr Radians from_degrees(double degrees) noexcept { return Radians(degrees * (kPi / 180.0)); }
[[nodiscard]] constexpr double to_degrees(Radians angle) noexcept { return angle.value() * (180.0 / kPi); }
/// 1 gf = 9.80665e-3 N, exactly (CGPM 1901).
[[nodiscard]] constexpr Newtons from_gram_force(double gram_force) noexcept { return Newtons(gram_force * 9.80665e-3); }
/// 1 N/RPM² = (30/π)² N/(rad/s)², about 91.19.
[[nodiscard]] constexpr ThrustCoefficient from_newtons_per_rpm2(double k) noexcept {
  return ThrustCoefficient(k / (kRadPerSecPerRpm * kRadPerSecPerRpm));
}
[[nodiscard]] constexpr double to_newtons_per_rpm2(ThrustCoefficient k) noexcept {
  return k.value() * (kRadPerSecPerRpm * kRadPerSecPerRpm);
}

/// T = k ω² (paper, equations 2 and 3).
[[nodiscard]] constexpr Newtons thrust_at(ThrustCoefficient k, RadPerSec speed) noexcept {
  return Newtons(k.value() * speed.value() * speed.value());
}

}  // namespace kphi
