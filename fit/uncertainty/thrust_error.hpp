// By how much the thrust may be wrong in flight: one number, at 95 %, for the φ and speeds that the coefficients claim.
//
// Who asks for a thrust gets k measured / k flown of it. What was measured is k at each occlusion, joined by chords,
// and nothing more. As shares of the thrust that was asked for (science.md, eq. 26 and 27):
//   off = |k flown − k measured| + |what the speed does to k| + |what a test found|,
// and u from the budget of k and of the speed's influence; the number holds a normal error of that mean and deviation
// 95 times of 100. What a test looks for enters with the size that was seen,
// whether it is significant or not, and with its error: a weak test does not make a good number. Between two φ k is
// anywhere between the chord and the chords beside it, drawn on (a curve that bends one way); with fewer than three
// occlusions anywhere between its two ends (a curve that falls).
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/model/identification.hpp"
#include "fit/uncertainty/budget.hpp"
#include "fit/uncertainty/speed_trend.hpp"

namespace kphi::fit {

/// One cause of it, with what makes it smaller.
struct ThrustErrorPart {
  std::string name;    ///< "mounting", "k(φ) beside the line", …
  double share = 0;    ///< of the thrust, 95 %
  std::string remedy;  ///< the next move; may be empty
};

/// The same for a drone that needs less: φ from 0 up to a row's, speeds that are no further than a column's from the
/// one to which k belongs.
struct ThrustErrorWithin {
  struct Row {
    double phi_deg = 0;
    std::vector<double> shares{};  ///< one per column, 95 %
  };
  double reference_rad_s = 0;
  std::vector<double> off_rad_s{};  ///< ascending, the last holds all speeds of the fit; one of 0 if none are known
  std::vector<Row> rows{};          ///< ascending, the last holds all φ at which a rotor carries
};

struct ThrustError {
  double share = std::numeric_limits<double>::quiet_NaN();  ///< of the thrust, 95 %; NaN: nobody knows
  double phi_deg = 0;                                       ///< where it is largest
  std::vector<ThrustErrorPart> parts{};                     ///< there, largest first
  /// From here on a rotor keeps less thrust than the library's floor, a tenth, and nothing flies on it: not counted.
  std::optional<double> carries_to_deg{};
  ThrustErrorWithin within{};
};

/// What the number is made of beside the coefficients.
struct ThrustEvidence {
  const ErrorSources& sources;  ///< of the bench and its steps, without the model of the speed
  std::span<const SpeedDependence> speed;
  const std::optional<SpeedTrend>& trend;  ///< that flies
  std::span<const OutlyingRun> outlying;
  std::optional<double> air_density_u;  ///< relative
  double plate_at_zero = 0;             ///< share by which a plate left on at 0° lowered K_T, where it looks like one
};

[[nodiscard]] ThrustError thrust_error(const Identification& identification, const ThrustEvidence& evidence);

/// "thrust within 1.4 % (95 %), most of it mounting, 1 %: mount each repetition anew (remount_each_repetition)".
[[nodiscard]] std::string words(const ThrustError& error);

}  // namespace kphi::fit
