// What coefficients.yaml says of errors and tests, and of the torque: blocks after the ones that fly.
#pragma once

#include <string>

#include "fit/analysis.hpp"

namespace kphi::fit {

/// YAML, the keys `uncertainty` and, where there is one, `torque`. The same analysis gives the same bytes.
[[nodiscard]] std::string format_uncertainty(const Analysis& analysis);

}  // namespace kphi::fit
