// Which doubts leave thrust over speed² as good as it is: all others keep a step out of averages and fits.
#pragma once

#include "results/step_mean.hpp"

namespace kphi::results {

inline constexpr std::uint32_t kHarmlessDoubts = [] {
  std::uint32_t bits = 0;
  for (const Doubt doubt :
       {Doubt::lost_samples, Doubt::stream_restarted, Doubt::box_trouble, Doubt::supply_out_of_band, Doubt::coil_hot,
        Doubt::slow_round_trip, Doubt::supply_sag, Doubt::supply_rise, Doubt::lag_unknown, Doubt::speed_glitch})
    bits |= static_cast<std::uint32_t>(doubt);
  return bits;
}();

}  // namespace kphi::results
