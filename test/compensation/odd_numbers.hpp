// What no caller should pass.
#pragma once

#include <limits>

namespace kphi::compensation {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace kphi::compensation
