// The figures of a fit.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "fit/report/gnuplot.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// Thrust at the top speed at one φ, in percent of the mean thrust at φ = 0.
struct ThrustShares {
  double phi_deg = 0;
  std::vector<double> percent;
};

/// The step means at the speed of "k at speed", one per repetition: the box plot shows them when the raw samples are
/// not available. Empty without a step at φ = 0.
[[nodiscard]] std::vector<ThrustShares> shares_of_steps(const Identification& identification);

/// One step of one run: how speed and thrust settle after the command, and what of it was averaged.
struct Settling {
  struct Sample {
    double time_s = 0;  ///< since the command
    double value = 0;
  };
  std::string run;  ///< file name
  double commanded_rad_s = 0;
  double window_begin_s = 0, window_end_s = 0;  ///< averaged, since the command
  std::vector<Sample> speed_rad_s;
  std::vector<Sample> thrust_n;  ///< means over bins of 10 ms, zero subtracted
};

/// What is drawn of a fit beside itself.
struct DrawnBeside {
  const Settling* settling = nullptr;
  const Settling* whole = nullptr;  ///< a whole run
  const Fitted* earlier = nullptr;  ///< another campaign of the propeller, as a ghost
  std::string earlier_words{};      ///< its folder, origin and date
  bool paper = false;               ///< what the paper says of this propeller
};

/// k(φ) of several propellers, and beside it k(φ)/K_T, which makes their lines comparable.
[[nodiscard]] Figure family_figure(std::span<const Fitted> family);

/// All figures that the data allow, in the order of the report: the paper's (box plots of the thrust shares over φ; on
/// the second axis, scaled so that K_T is at 100 %, the coefficients and the curve), thrust with residuals, k against
/// speed, repetitions, power, settling, a whole run. Throws RecordError when the folder cannot be written;
/// a missing gnuplot only skips the figures.
[[nodiscard]] Figures draw_figures(const Fitted& fitted, const std::vector<ThrustShares>& shares,
                                   const std::filesystem::path& folder, const std::string& gnuplot = "gnuplot",
                                   const DrawnBeside& beside = {});

}  // namespace kphi::fit
