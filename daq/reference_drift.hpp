// Two runs without occlusion, at the begin and at the end of a session: what changed on the bench meanwhile.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "results/step_mean.hpp"

namespace kphi::daq {

/// A bench whose k of the same propeller changed by more than this share (and twice its uncertainty) has drifted: as
/// much as a zero may drift.
inline constexpr double kReferenceDriftShare = 0.005;

struct ReferenceDrift {
  double k_begin = 0;  ///< N/(rad/s)², least squares over the levels that both runs have
  double k_end = 0;
  double share = 0;       ///< k_end / k_begin - 1; at equal density of the air where it is known of both
  double u_share = 0;     ///< standard, from within the steps and the zeros
  bool same_air = false;  ///< share is at equal density
  [[nodiscard]] bool drifted() const;
  /// One line.
  [[nodiscard]] std::string to_words() const;
};

/// `steps`: of the reference runs, repetition -1, -2, …; the first is held against the last. Nothing when there are not
/// two, or one of them has too few steps without a doubt about k.
[[nodiscard]] std::optional<ReferenceDrift> reference_drift(std::span<const results::StepMean> steps);

}  // namespace kphi::daq
