// The figures behind the first one: what the model leaves over, how k moves with speed and from run to run, how a step
// settles, and several propellers side by side.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fit/report/figures.hpp"

namespace kphi::fit {

/// Thrust over squared speed at every φ, with the fits, and below it what they leave over.
[[nodiscard]] Figure thrust_figure(const Identification& identification);

/// T/ω² of each level against the k of the range, in percent: flat where T = k ω² is true.
[[nodiscard]] Figure speed_figure(const Identification& identification);

/// k of each repetition against that of its occlusion, in percent, with two standard errors.
[[nodiscard]] Figure repetition_figure(const Identification& identification);

/// Thrust per electrical power over the thrust, one course per φ; without steps whose power nobody measured.
[[nodiscard]] Figure power_figure(const Identification& identification);

/// One step of one run: how speed and thrust come to rest after the command, and what of it was averaged.
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
[[nodiscard]] Figure settling_figure(const Settling& settling);

/// k(φ) of several propellers, and beside it k(φ)/K_T, by which their lines can be compared.
[[nodiscard]] Figure family_figure(std::span<const Identification* const> family);

/// All that the data allow, in the order of the report; `settling` may be null. Never throws for gnuplot's sake; throws
/// RecordError when the folder cannot be written.
[[nodiscard]] Figures draw_figures(const Identification& identification, const std::vector<ThrustShares>& shares,
                                   const std::filesystem::path& folder, const std::string& gnuplot = "gnuplot",
                                   const Settling* settling = nullptr);

}  // namespace kphi::fit
