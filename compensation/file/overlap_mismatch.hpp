// One line for those whose coefficients and vehicle measure φ differently. Compensator::build refuses it, too, but
// knows no files.
#pragma once

#include <optional>
#include <string>

#include "compensation/overlap_measure.hpp"

namespace kphi::compensation {

/// What is wrong and the next move, or nothing if the two agree. The texts name the files.
[[nodiscard]] inline std::optional<std::string> overlap_mismatch(OverlapMeasure fitted, const std::string& coefficients,
                                                                 OverlapMeasure flown, const std::string& vehicle) {
  if (fitted == flown) return std::nullopt;
  const std::string as_fitted(name_of(fitted)), as_flown(name_of(flown));
  return coefficients + ": fitted with overlap " + as_fitted + ", but " + vehicle + " flies with " + as_flown +
         "; write `overlap: " + as_fitted + "` in the vehicle file, or fit again with " + as_flown;
}

}  // namespace kphi::compensation
