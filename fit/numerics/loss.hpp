// Robust losses: how much a point far from a fit may pull at it (ρ of science.md, eq. 19).
#pragma once

#include <cstdint>

namespace kphi::fit {

/// Tuned to 95 % efficiency under normal errors; σ is that of the points.
enum class Loss : std::uint8_t {
  none,
  huber,   ///< constant beyond 1.345 σ
  cauchy,  ///< falls beyond 2.385 σ
  tukey,   ///< zero beyond 4.685 σ
};

/// For options and files: "none", "huber", "cauchy", "tukey".
[[nodiscard]] const char* name_of(Loss loss);

/// Weight in [0, 1] of the squared residual of a point `deviation` σ from the fit.
[[nodiscard]] double robust_weight(Loss loss, double deviation);

/// A point with a smaller robust weight counts as rejected and is listed.
inline constexpr double kRejectedWeight = 0.25;

}  // namespace kphi::fit
