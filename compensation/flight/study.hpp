// The nine experiments in many drawn circumstances, and what they say of the compensation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "compensation/flight/flight.hpp"

namespace kphi::flight {

/// A propeller as its coefficient file names it; 0: it does not say.
struct PropellerKind {
  double diameter_in = 0;
  int blades = 0;
};
/// K_T of such a propeller as the paper tells of its four: 1.3e-8 and 1.7e-8 N/RPM² for two and three blades of 5
/// inches, 2.6e-8 and 3.1e-8 of 6; between and beyond with the fourth power of the diameter. Three blades if it does
/// not say.
[[nodiscard]] ThrustCoefficient published_thrust(const PropellerKind& kind);
/// What propellers of one size and number of blades differ by, as a share of that; measured ones of 5 inches reach from
/// 1.1e-8 to 1.5e-8 N/RPM².
inline constexpr double kPublishedScatter = 0.3;

/// The world where nobody says another one: the errors of Truth{}, the vehicle's drag, and a K_T.
struct AssumedWorld {
  Truth truth;
  ThrustCoefficient published;  ///< N/(rad/s)², for the file's propeller
  bool as_in_file = false;      ///< the K_T of the file, which is within kPublishedScatter; else the published one
};
/// A size that the file does not say is that of the vehicle.
[[nodiscard]] AssumedWorld assumed_world(const Vehicle& vehicle, PropellerKind kind,
                                         const compensation::Rotors<compensation::ThrustCurve>& curves);

/// The one set of circumstances that single flights use. `seed` is of the estimator's noise.
[[nodiscard]] Scene nominal_scene(const Vehicle& vehicle, const PilotSettings& pilot,
                                  const compensation::Rotors<compensation::ThrustCurve>& curves, const Truth& world,
                                  std::uint64_t seed);

/// Draw `index` of the seed of `nominal`, whatever was drawn before: the three loss laws in turn, and about the nominal
/// world γ from 0.4 less to 0.1 more, mass 1.5 %, K_T 1 % per rotor, arm angles 0.02 rad (hubs: of their way), centre
/// of gravity 1.5 mm per axis, draught 0.1 m/s per horizontal axis, k(φ) 3 % in its fall and 0.01 K_T in all off; and
/// times those of the vehicle file: stiffness of the attitude (its gain times that of the rates, each by the root) 0.8
/// to 2, kpxy 5/6 to 10/6, drag 1/3 to 5/3, how far arms stop short in O 0.4 to 2 (ranges are uniform, else standard
/// deviations).
[[nodiscard]] Scene drawn_scene(const Scene& nominal, std::size_t index);

using NineFlights = std::array<FlightResult, kExperiments.size()>;

/// Experiment `index` with a noise of its own: of the stream `index` of the scene's seed.
[[nodiscard]] FlightResult fly_one(std::size_t index, Scene scene, const Shadow& shadow,
                                   std::vector<TraceRow>* trace = nullptr);
[[nodiscard]] NineFlights fly_all(const Scene& scene, const Shadow& shadow);

/// The numbers that one set of nine flights is judged by. Errors in m. Valid unless a flight was lost.
struct Merits {
  double hover_z_x = 0;      ///< in X, where nothing is covered
  double hover_z_plain = 0;  ///< reference − estimate: positive is below the reference
  double hover_z_compensated = 0;
  double hover_xy_plain = 0;  ///< horizontal distance
  double hover_xy_compensated = 0;
  double forward_x = 0;            ///< mean distance, over the legs in X
  double forward_plain = 0;        ///< over the four legs in O n.c.
  double forward_compensated = 0;  ///< over the four legs in O c.
  double square_speed_ratio = 1;   ///< mean ω² of steady hover in O, compensated over not
  bool lost_plain = false;         ///< at least one flight was lost in O n.c.
  bool lost_compensated = false;   ///< at least one flight was lost in another leg

  [[nodiscard]] bool lost() const noexcept { return lost_plain || lost_compensated; }
  [[nodiscard]] double hover_z_ratio() const noexcept;
  [[nodiscard]] double hover_xy_ratio() const noexcept { return hover_xy_compensated / hover_xy_plain; }
  [[nodiscard]] double forward_ratio() const noexcept { return forward_compensated / forward_plain; }
};

[[nodiscard]] Merits merits_of(const NineFlights& flights) noexcept;

/// One of these numbers, as `kphi fly` prints it and writes it with --json.
struct Merit {
  const char* key;
  const char* title;  ///< empty: only in JSON
  const char* paper;  ///< what the paper found
  double (*of)(const Merits&);
};
inline constexpr std::array<Merit, 12> kMerits{{
    {"hover_z_x_m", "hover z, X [m]", "0.014 (unsigned)", [](const Merits& m) { return m.hover_z_x; }},
    {"hover_z_plain_m", "hover z, O n.c. [m]", "0.17 / 0.159", [](const Merits& m) { return m.hover_z_plain; }},
    {"hover_z_compensated_m", "hover z, O c. [m]", "-0.043 / 0.011 (unsigned)",
     [](const Merits& m) { return m.hover_z_compensated; }},
    {"hover_z_ratio", "hover z, c. over n.c.", "0.25 / 0.067", [](const Merits& m) { return m.hover_z_ratio(); }},
    {"hover_xy_plain_m", "hover xy, O n.c. [m]", "0.246 / 0.078", [](const Merits& m) { return m.hover_xy_plain; }},
    {"hover_xy_compensated_m", "hover xy, O c. [m]", "0.053 / 0.010",
     [](const Merits& m) { return m.hover_xy_compensated; }},
    {"hover_xy_ratio", "", "", [](const Merits& m) { return m.hover_xy_ratio(); }},
    {"forward_x_m", "forward, X [m]", "0.077 to 0.121", [](const Merits& m) { return m.forward_x; }},
    {"forward_plain_m", "forward, O n.c. [m]", "0.213 to 0.269", [](const Merits& m) { return m.forward_plain; }},
    {"forward_compensated_m", "forward, O c. [m]", "0.104 to 0.139",
     [](const Merits& m) { return m.forward_compensated; }},
    {"forward_ratio", "forward, c. over n.c.", "0.52 and 0.62", [](const Merits& m) { return m.forward_ratio(); }},
    {"square_speed_ratio", "mean speed^2, O hover, c./n.c.", "\"no additional power\"",
     [](const Merits& m) { return m.square_speed_ratio; }},
}};

struct Draw {
  Scene scene;
  NineFlights flights;
};

/// Draws 0 to count − 1 around `nominal` on `threads` threads; the result does not depend on their number.
[[nodiscard]] std::vector<Draw> fly_draws(const Scene& nominal, const Shadow& shadow, std::size_t count,
                                          std::size_t threads);

struct Percentiles {
  double p10 = 0, p50 = 0, p90 = 0;
};
/// Between the order statistics in a straight line (type 7); zeros of an empty list. NaN must not be in it.
[[nodiscard]] Percentiles percentiles(std::vector<double> values);

/// What a study found. The percentiles are over the draws of which no flight was lost; such a draw counts as better
/// with compensation only if the flight was lost without it and none was lost with it.
struct Findings {
  std::size_t draws = 0;
  std::size_t kept = 0;  ///< draws of which no flight was lost
  std::size_t lost_plain = 0;
  std::size_t lost_compensated = 0;
  std::optional<double> hover_z_x;                   ///< m, median over all draws that hovered in X at all
  double hover_z_better = 0;                         ///< share of the draws, |z|
  double forward_better = 0;                         ///< share of the draws
  std::array<Percentiles, kMerits.size()> merits{};  ///< in the order of kMerits
  /// Medians of the kept draws with one law of loss; without meaning if there are none.
  struct OfLaw {
    std::size_t kept = 0;
    double hover_z_ratio = 0, forward_ratio = 0;
  };
  std::array<OfLaw, kLossLaws> by_law{};
};

[[nodiscard]] Findings findings_of(const std::vector<Draw>& draws);

}  // namespace kphi::flight
