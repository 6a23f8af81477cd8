// Preliminary k of a step right after it, for the page. The record uses the raw samples (results/reduction).
#pragma once

#include <cstddef>
#include <vector>

#include "compensation/units.hpp"

namespace kphi::daq::live {

class QuickLook {
 public:
  struct Result {
    std::size_t n = 0;       ///< number of ticks; 0: no result
    double thrust_n = 0;     ///< mean
    double speed_rad_s = 0;  ///< root of the mean square
    double k = 0;            ///< N/(rad/s)²: mean thrust over mean ω²
    double u_k = 0;  ///< standard uncertainty, from the scatter of kBlocks successive means; not finite: unknown
  };
  static constexpr std::size_t kBlocks = 5;

  void begin() { looks_.clear(); }
  void add(Newtons thrust, RadPerSec speed) { looks_.push_back({thrust.value(), speed.value() * speed.value()}); }
  [[nodiscard]] Result result() const;

 private:
  struct Look {
    double thrust_n, speed_squared;
  };
  [[nodiscard]] Look mean(std::size_t begin, std::size_t end) const;
  std::vector<Look> looks_;
};

}  // namespace kphi::daq::live
