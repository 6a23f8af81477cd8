// The reference runs at the two ends of a session, compared.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "results/step_mean.hpp"

namespace kphi::results {

/// The bench has drifted if k of the same propeller changed by more than this share and twice its uncertainty.
inline constexpr double kReferenceDriftShare = 0.005;

struct ReferenceDrift {
  double k_begin = 0;  ///< N/(rad/s)², least squares over the levels that both runs have
  double k_end = 0;
  double share = 0;       ///< k_end / k_begin - 1; at equal air density if both are known
  double u_share = 0;     ///< standard, from within the steps, the zeros and their drift
  bool same_air = false;  ///< share is at equal density
  [[nodiscard]] bool drifted() const;
  /// One line.
  [[nodiscard]] std::string to_words() const;
};

/// `steps`: of the reference runs, repetition -1, -2, …; compares the first with the last. nullopt if there are not
/// two, or one of them has too few good steps.
[[nodiscard]] std::optional<ReferenceDrift> reference_drift(std::span<const StepMean> steps);

}  // namespace kphi::results
