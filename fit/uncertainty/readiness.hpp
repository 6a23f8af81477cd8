// Whether a drone may fly on a result: by how much its thrust may be wrong (science.md, eq. 27), and what speaks
// against its numbers.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/model/identification.hpp"
#include "fit/uncertainty/speed_dependence.hpp"
#include "fit/uncertainty/thrust_error.hpp"

namespace kphi::fit {

enum class Readiness : std::uint8_t {
  fit_to_fly,
  with_care,  ///< read number and doubts first
  not_yet,    ///< the thrust would be wrong: mend or repeat first
  no_curve,   ///< no occlusion was measured: nothing to fly with
};

/// Up to which error of the thrust (95 %, share) a result is fit to fly, and to fly with care.
struct ReadinessLimits {
  double fit_to_fly = 0.03, with_care = 0.10;
};

/// One thing that speaks against the result: what, how large, what follows from it, what to do.
struct Doubt {
  Readiness readiness = Readiness::fit_to_fly;  ///< at best; what a test of the model found counts in the number
  std::string text;
};

struct FlightReadiness {
  ThrustError error{};
  /// Worst first. Of the tests of the model (k against speed, the curve's form, a run that stands out) those that fail
  /// under Holm at 5 % for all together; a curve that nothing could test; and what no propeller can do: k that rises
  /// with φ, more thrust than its power can make, a unit mixed up.
  std::vector<Doubt> doubts{};
  bool has_curve = true;
  ReadinessLimits limits{};

  /// Of the worst doubt.
  [[nodiscard]] Readiness by_doubts() const;
  /// By the number, and no better than the worst doubt.
  [[nodiscard]] Readiness readiness() const;
};

/// What was found out about the model; see Analysis.
struct ModelTests {
  std::span<const SpeedDependence> speed;
  const Curvature& curvature;
  std::span<const OutlyingRun> outlying;
  std::span<const HypothesisTest> differences;
  const std::optional<SpeedTrend>& trend;  ///< as the coefficient file holds it
  const ErrorSources& sources;             ///< of the bench and its steps, without the model of the speed
  std::optional<double> air_density_u;     ///< relative
};

[[nodiscard]] FlightReadiness flight_readiness(const Identification& identification, const ModelTests& tests,
                                               const ReadinessLimits& limits = {});

/// The number in words; with a doubt that has no size: "not counting what is said below, thrust within 1.4 % …".
[[nodiscard]] std::string number_words(const FlightReadiness& flight);

/// "fit to fly: thrust within 1.4 % (95 %), …": the verdict in one line.
[[nodiscard]] std::string verdict_line(const FlightReadiness& flight);

/// "fit to fly", "fly with care", "do not fly yet", "K_T alone, no k(φ) to fly with".
[[nodiscard]] const char* words(Readiness readiness);

/// "fit_to_fly", "with_care", "not_yet", "no_curve".
[[nodiscard]] const char* name_of(Readiness readiness);
/// nullopt for any other name.
[[nodiscard]] std::optional<Readiness> readiness_named(const std::string& name);

}  // namespace kphi::fit
