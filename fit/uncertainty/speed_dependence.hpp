// Tests T = k ω²: k at each speed, its trend with speed, and the lack of fit against the scatter of repetitions. On
// real propellers k rises by up to a fifth over the speeds of a sweep, far above all noise.
//
// (science.md, eq. 23 and 24.) All steps of a run share its zero: an error z of it changes T/ω² by z/ω², which looks
// like a dependence on speed. Therefore every run has its own zero in these tests, known to within the uncertainty in
// its steps (a pseudo-observation: Theil, Goldberger, Int. Econ. Rev. 2 (1961) 65); without that uncertainty the zero
// is free and absorbs a constant force. Other errors of neighbouring steps (slow noise, a wandering zero) show in the
// differences between repetitions: the trend is judged by its scatter from run to run, pooled over all φ, and the lack
// of fit with degrees of freedom reduced for correlated steps (Box, Ann. Math. Stat. 25 (1954) 484). A single
// repetition shows none of them: its trend is as uncertain as its own residuals say, and a zero that wanders between
// its two measurements as zeros of this campaign do (a random walk tied at both ends) makes of it.
#pragma once

#include <span>
#include <vector>

#include "fit/model/identification.hpp"
#include "fit/numerics/hypothesis_test.hpp"

namespace kphi::fit {

struct SpeedDependence {
  double phi_deg = 0;
  std::vector<SpeedCoefficient> levels;  ///< at each commanded speed, ascending
  /// Of k from the lowest to the highest speed, as a share of k, by the straight line through T/ω² weighted in ω⁴ and
  /// by the noise; mean over the runs.
  Estimate change;
  /// Level means about k ω² and zero against the interaction of level and repetition; an error of a whole run
  /// (mounting, air) is in neither. Needs two repetitions.
  HypothesisTest lack_of_fit;
  HypothesisTest trend;  ///< change = 0
  /// Either test at half the level, so that both together reject a true T = k ω² once in twenty.
  [[nodiscard]] bool depends() const { return lack_of_fit.p < kTestLevel / 2 || trend.p < kTestLevel / 2; }
  /// Where k depends on the speed, by how much the k at any speed of the range is off: the rms deviation of the levels'
  /// k, weighted in ω⁴, beyond what noise explains (of a single repetition with its noise), or, if larger, that of the
  /// straight line with all speeds as likely. N/(rad/s)².
  double inadequacy = 0;
};

/// One per φ, in their order. Levels that not every repetition of a φ measured are left out of its lack-of-fit test.
/// `zero_movement`: as Repeatability has it.
[[nodiscard]] std::vector<SpeedDependence> speed_dependence(std::span<const OcclusionCoefficient> table,
                                                            const Estimate& zero_movement = {});

}  // namespace kphi::fit
