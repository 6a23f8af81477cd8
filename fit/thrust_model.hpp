// The thrust of one propeller as a function of its speed. Residuals, tests and plots all call this one function.
#pragma once

namespace kphi::fit {

/// T = k ω² + linear ω + offset. The paper's model (equations 2 and 3) is k alone; maps of the flight community also
/// come with three terms. Scalar is double, or a Ceres Jet while fitting.
template <class Scalar>
struct ThrustParameters {
  Scalar k{};       ///< N/(rad/s)²
  Scalar linear{};  ///< N/(rad/s)
  Scalar offset{};  ///< N
};

/// Thrust in N at `speed` in rad/s; the same form holds in any consistently scaled units.
template <class Scalar>
[[nodiscard]] constexpr Scalar thrust(const ThrustParameters<Scalar>& parameters, double speed) {
  return (parameters.k * speed + parameters.linear) * speed + parameters.offset;
}

}  // namespace kphi::fit
