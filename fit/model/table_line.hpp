// Tables of k: repeated angles averaged; and the line through a table that cannot fly, without the k of φ = 0 or with
// angles beyond a circle. What such a table allows is fitted; the drone needs more.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "fit/model/curve_fit.hpp"

namespace kphi::fit {

/// A table with one row for each φ.
struct RepeatedAngles {
  std::vector<CurvePoint> points;    ///< ascending φ
  std::size_t angles = 0, rows = 0;  ///< that were repeated, and how many rows they had
  double freedom = 0;                ///< degrees of freedom of their scatter
  double scatter = 0;     ///< of k from row to row, as a share of k, or, where every row has its u, in these u
  bool weighted = false;  ///< every row has its u

  [[nodiscard]] std::string words() const;
};

/// Averages the rows of each φ, with the scatter as their error, pooled over all φ since two or three rows alone are
/// too few. Where every row has its u: weighted by 1/u², and the u are enlarged if the rows scatter more than they say
/// (Birge, Phys. Rev. 40 (1932) 207). Otherwise each row has the pooled scatter as a share of k, times Student's factor
/// over that of endless freedom, since a table has no degrees of freedom.
[[nodiscard]] RepeatedAngles average_repeated(std::span<const CurvePoint> table);

/// Why no curve that flies can be drawn through the table, repeated angles aside; empty: nothing stands against it.
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
