// Since when a step is settled, and whether its thrust drifts. Pure functions over means of equal bins.
#pragma once

#include <cstddef>
#include <span>

namespace kphi::results {

/// What is averaged at least, s: over so much at its end must a step be settled. Half of what the discard leaves
/// when that is less.
inline constexpr double kLeastWindow = 0.5;
/// A change of the thrust from end to end of the window is none when it is below this share of the thrust (what k may
/// be wrong by), or within the 95 % interval of the slope.
inline constexpr double kSteadyShare = 0.001;
/// So certain must a slope be for a step to be called unsettled. The search for a window looks at 95 %; of steps at
/// rest one in 200 passes none of its looks.
inline constexpr double kUnsettledConfidence = 0.9995;
/// Thrust at constant speed that in the second half of a step still changes by more than this share of it drifts.
inline constexpr double kDriftShare = 0.005;

struct Settling {
  std::size_t begin = 0;  ///< first bin of the window, which goes to the end of the step
  bool settled = false;
};

/// The earliest window from `first` on (bins; NaN holds nothing) whose slope is inside its own 95 % interval. The
/// uncertainty comes from the last two least windows, where the transient is least. When there is none, the last of the
/// least windows, unsettled if it moves for certain (kUnsettledConfidence). `planned`: bins that the minimum discard
/// leaves.
[[nodiscard]] Settling settle(std::span<const double> thrust, std::size_t first, std::size_t planned, double bin_s);

/// The thrust rises, or falls, all through both halves, by a rank test that needs no idea of the noise (Kendall), and
/// in the second alone by more than kDriftShare of it: no transient that dies.
[[nodiscard]] bool drifts(std::span<const double> thrust);

}  // namespace kphi::results
