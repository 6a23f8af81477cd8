// How the certainty that is wanted of the k of a run is spread over its steps, and which steps it can do without.
#pragma once

#include <cstddef>
#include <limits>
#include <span>

#include "profiles/campaign.hpp"
#include "profiles/plan.hpp"

namespace kphi::profiles {

/// Follows one run, for a profile with `until`. k = Σ x T / Σ x² with x = ω², so its variance is Σ x² u² / (Σ x²)² over
/// the steps that are held; noise may take half of the interval that is wanted. What one step leaves of that, the later
/// ones may use (science.md, eq. 31). Decides by uncertainties alone, never by how well a thrust fits: so it does not
/// bias k.
class RunCertainty {
 public:
  /// A run of fewer steps leaves none out.
  static constexpr std::size_t kFewestSteps = 20;

  /// `steps` of the run in any order.
  RunCertainty(const Until& until, std::span<const PlannedStep> steps);

  /// Whether k would not be certain enough without this step, the others still to come held for the shortest time
  /// at the loudest noise so far. Every second level, the slowest and the fastest are always needed: they show whether
  /// k depends on speed.
  [[nodiscard]] bool needs(const PlannedStep& step) const;
  /// Standard uncertainty of the mean thrust of this step, N, that is good enough, if every step that is left takes an
  /// equal part. `thrust_n`: its mean so far, the zero taken off.
  [[nodiscard]] double enough_n(const PlannedStep& step, double thrust_n) const;

  /// Once for each step: it was held for `held_s`; its uncertainty is NaN if it is not known, and then it does not
  /// count.
  void held(const PlannedStep& step, double thrust_n, double u_n, double held_s);
  void left_out(const PlannedStep& step);

 private:
  /// Standard uncertainty of the k of the run that its noise may make.
  [[nodiscard]] double wanted_u(double k) const;
  void passed(double x);

  Until until_;
  std::size_t steps_ = 0, to_come_ = 0;
  double slowest_ = std::numeric_limits<double>::infinity(), fastest_ = 0;  ///< rad/s
  double squares_ = 0;                                                      ///< Σ x² of the steps held and to come
  double squares_to_come_ = 0;                                              ///< Σ x² of the steps to come
  double spent_ = 0;                                                        ///< Σ x² u² of the steps held
  double products_ = 0, squares_held_ = 0;                                  ///< Σ x T, Σ x² of the steps held
  double loudest_n_ = 0;  ///< largest u of a step held for the shortest time, N; 0: not known
};

}  // namespace kphi::profiles
