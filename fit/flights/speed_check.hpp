// Whether the logged speeds are those of the rotors. Blades shake the body a whole number of times a turn, and the
// accelerometer feels it, folded by its sampling or not (science.md, eq. 43): a line at another multiple is a wrong
// pole count, which nothing else in a log shows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "fit/flights/flight_log.hpp"
#include "fit/numerics/hypothesis_test.hpp"

namespace kphi::fit {

struct SpeedCheck {
  enum class Verdict : std::uint8_t {
    not_felt,      ///< no line follows the rotors, or several that cannot belong together: nothing is known
    whole,         ///< at a whole multiple: no error but a factor of 2 or 3
    confirmed,     ///< the strongest line is that of the blades
    contradicted,  ///< at a multiple that no propeller makes, or not this one
  };
  Verdict verdict = Verdict::not_felt;
  Estimate beats{};  ///< strongest line, per logged turn
  int blades = 0;    ///< of the propeller; 0: not told
};

/// By at most 120 pieces of a quarter of a second. `blades` 0: not told.
[[nodiscard]] SpeedCheck check_speeds(const FlightLog& log, std::size_t rotors, int blades);

/// "not_felt", "whole", "confirmed", "contradicted"
[[nodiscard]] const char* name_of(SpeedCheck::Verdict verdict);

/// "the body shakes 2.001 ± 0.002 times a logged turn, as 2 blades do"
[[nodiscard]] std::string words(const SpeedCheck& check);

}  // namespace kphi::fit
