// Channels of different clocks on one grid of times, and by how much one of them is late.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "fit/flights/flight_log.hpp"

namespace kphi::fit {

/// Median distance of its values, s; 0 for fewer than two.
[[nodiscard]] double period_of(const FlightChannel& channel);

/// Times start_s + i step_s.
struct TimeGrid {
  double start_s = 0, step_s = 0;
  std::size_t count = 0;
  [[nodiscard]] double time(std::size_t i) const { return start_s + step_s * static_cast<double>(i); }
};

/// The times that all of these have in common; count 0: none. Throws FitError beyond kMostFlightValues.
[[nodiscard]] TimeGrid common_grid(std::span<const FlightChannel* const> channels, double step_s);

/// Values on the grid, NaN before and after the channel and in gaps longer than `longest_gap_s`. Between its values a
/// channel is a straight line; of one that is denser than the grid each value is the mean of that line, weighted by a
/// triangle of ± one step. That delays nothing and passes sinc²(f step): .97 at a tenth of the grid's rate, of what
/// would alias to there .012 (science.md, eq. 39).
[[nodiscard]] std::vector<double> resample(const FlightChannel& channel, const TimeGrid& grid, double longest_gap_s);

/// y(t) = scale x(t − seconds) + offset.
struct Delay {
  double seconds = 0;
  double u_s = 0;  ///< standard, 29 degrees of freedom: by the scatter among 30 blocks of time
  double scale = 0;
  double correlation = 0;
};

/// Delay of y behind x, both on one grid, by least squares from the peak of their cross-correlation on (science.md, eq.
/// 40). Pairs with a NaN are left out. nullopt: fewer than 100 pairs, either is constant, or the peak lies at the end
/// of ± `longest_s`. Takes time ∝ size · longest_s/step_s.
[[nodiscard]] std::optional<Delay> delay_between(std::span<const double> x, std::span<const double> y, double step_s,
                                                 double longest_s);

}  // namespace kphi::fit
