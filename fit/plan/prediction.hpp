// How certain a campaign will be that was not run yet: the budget of `kphi fit`, with the noise of its stand.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fit/plan/stand_noise.hpp"
#include "profiles/campaign.hpp"

namespace kphi::fit {

/// A number that somebody wants to know.
struct Wanted {
  enum class Kind : std::uint8_t { thrust_coefficient, slope, k, scaling_factor };
  Kind kind{};
  double phi_deg = 0;                      ///< of k(φ) and k_i(φ)
  [[nodiscard]] std::string name() const;  ///< "K_T", "slope", "k(135)", "k_i(135)"
};

/// How well: half of the 95 % interval as a share of the number.
struct Wish {
  Wanted of;
  double share = 0;
};

/// "slope 1 %", "k(135) 0.5 %", "K_T 0.2%". Throws ConfigurationError.
[[nodiscard]] Wish parse_wish(const std::string& text);

/// The numbers that are told where nobody wishes for one: K_T, slope, k at half of the widest occlusion.
[[nodiscard]] std::vector<Wanted> usual_wants(const profiles::Campaign& campaign);

/// With steps that end by themselves (until): as many evenly spaced steps as a run is expected to hold, for as long as
/// their mean.
[[nodiscard]] profiles::Campaign as_expected(profiles::Campaign campaign, const StandNoise& noise);

class Prediction {
 public:
  /// `bench`: errors that no repetition shows; unknown ones are left out, as in a fit. Throws ConfigurationError where
  /// the campaign has no φ = 0, or too few occlusions for the curve.
  Prediction(const profiles::Campaign& campaign, const StandNoise& noise, const BenchUncertainty& bench,
             const CurveOptions& curve = {});

  /// Its value and, row by row, its uncertainty. Throws ConfigurationError for a φ beyond the widest occlusion.
  [[nodiscard]] Budget of(const Wanted& wanted) const;
  /// Bend of k(φ), as a share of K_T at half of the range, that its test will find in about 19 of 20 campaigns;
  /// infinite with two occlusions. science.md, eq. 30.
  [[nodiscard]] double bend_seen() const;

 private:
  StandNoise noise_;
  std::vector<double> phis_;
  Repeatability repeatability_;
  ErrorSources sources_;
  CurveFit curve_;
  CurveFit line_;
};

/// Half of the 95 % interval as a share of the value.
[[nodiscard]] double share_of(const Budget& budget);

/// A share in percent with the digits that a reader needs: "0.060", "0.25", "12.5".
[[nodiscard]] std::string in_percent(double share);

/// The row that contributes most; nullptr if none is known.
[[nodiscard]] const BudgetRow* largest_row(const Budget& budget);

}  // namespace kphi::fit
