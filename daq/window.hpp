// A stretch of bench time.
#pragma once

#include "results/records.hpp"

namespace kphi::daq {

struct Window {
  results::Nanoseconds begin = 0;
  results::Nanoseconds end = 0;  ///< not in it

  [[nodiscard]] double centre() const { return 0.5 * (static_cast<double>(begin) + static_cast<double>(end)); }
  [[nodiscard]] double seconds() const { return 1e-9 * static_cast<double>(end - begin); }
};

}  // namespace kphi::daq
