// The line through a table of k that cannot fly: without the k of φ = 0, with a φ twice, or with angles beyond a
// circle. What such a table allows is fitted; the drone needs more.
#pragma once

#include <span>
#include <string>

#include "fit/model/curve_fit.hpp"

namespace kphi::fit {

/// Why no curve that flies can be drawn through the table; empty: nothing stands against it.
[[nodiscard]] std::string obstacle_to_flight(std::span<const CurvePoint> table);

/// k(φ) = intercept + slope φ. The uncertainties are by the scatter of the points about the line; NaN where
/// no point is to spare.
struct TableLine {
  bool anchored = false;   ///< the line starts at the given k(0)
  Estimate intercept;      ///< N/(rad/s)²; u 0 if anchored
  Estimate slope_per_deg;  ///< N/(rad/s)²/deg
  double scatter = 0;  ///< standard deviation of the points about the line, N/(rad/s)²; weighted: 1 if their u is right
  bool weighted = false;   ///< by 1/u², where every point has its u
  std::size_t points = 0;  ///< that carry it
};

/// Through all points, φ = 0 included; `anchored`: through the one k(0), which the others do not move. Throws FitError
/// for fewer points than terms, one and the same φ throughout, or an anchor that is missing or given twice.
[[nodiscard]] TableLine fit_table_line(std::span<const CurvePoint> table, bool anchored);

}  // namespace kphi::fit
