// Whether a drone may fly on a result: the tests of the model, taken together, and each that falls in words.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/model/identification.hpp"
#include "fit/uncertainty/speed_dependence.hpp"

namespace kphi::fit {

enum class Readiness : std::uint8_t {
  fit_to_fly,
  with_care,  ///< read the doubts first
  not_yet,    ///< the thrust would be wrong: mend or repeat first
  no_curve,   ///< no occlusion was measured: nothing to fly with
};

/// One thing that speaks against the result: what, how large, what follows from it, what to do.
struct Doubt {
  Readiness readiness = Readiness::with_care;
  std::string text;
};

struct FlightReadiness {
  /// Worst first. Of the tests of the model (k against speed, the curve's form, a run that stands out) those that fall
  /// under Holm at 5 % for all together; k that rises with φ; one repetition, which shows no scatter; and a curve that
  /// nothing could test.
  std::vector<Doubt> doubts;
  bool has_curve = true;

  [[nodiscard]] Readiness readiness() const {
    return !has_curve ? Readiness::no_curve : doubts.empty() ? Readiness::fit_to_fly : doubts.front().readiness;
  }
};

/// What was found out about the model; see Analysis.
struct ModelTests {
  std::span<const SpeedDependence> speed;
  const Curvature& curvature;
  std::span<const OutlyingRun> outlying;
  std::span<const HypothesisTest> differences;
  bool trend_flies = false;  ///< the coefficient file holds how k changes with the speed
};

[[nodiscard]] FlightReadiness flight_readiness(const Identification& identification, const ModelTests& tests);

/// "fit to fly", "fly with care", "do not fly yet", "K_T alone, no k(φ) to fly with".
[[nodiscard]] const char* words(Readiness readiness);

/// "fit_to_fly", "with_care", "not_yet", "no_curve".
[[nodiscard]] const char* name_of(Readiness readiness);
/// nullopt for any other name.
[[nodiscard]] std::optional<Readiness> readiness_named(const std::string& name);

}  // namespace kphi::fit
