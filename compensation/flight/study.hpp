// The nine experiments in many drawn circumstances, and what they say of the compensation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "compensation/flight/draw.hpp"

namespace kphi::flight {

using NineFlights = std::array<FlightResult, kExperiments.size()>;

/// Experiment `index` with a noise of its own: of the stream `index` of the scene's seed.
[[nodiscard]] FlightResult fly_one(std::size_t index, Scene scene, const Shadow& shadow,
                                   std::vector<TraceRow>* trace = nullptr);
[[nodiscard]] NineFlights fly_all(const Scene& scene, const Shadow& shadow);

/// The numbers that one set of nine flights is judged by. Errors in m. Valid unless a flight was lost.
struct Merits {
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
  double hover_z_better = 0;  ///< share of the draws, |z|
  double forward_better = 0;  ///< share of the draws
  Percentiles hover_z_plain, hover_z_compensated, hover_z_ratio;
  Percentiles hover_xy_plain, hover_xy_compensated, hover_xy_ratio;
  Percentiles forward_x, forward_plain, forward_compensated, forward_ratio;
  Percentiles square_speed_ratio;
  /// Medians of the kept draws with one law of loss; they mean nothing if there are none.
  struct OfLaw {
    std::size_t kept = 0;
    double hover_z_ratio = 0, forward_ratio = 0;
  };
  std::array<OfLaw, kLossLaws> by_law{};
};

[[nodiscard]] Findings findings_of(const std::vector<Draw>& draws);

}  // namespace kphi::flight
