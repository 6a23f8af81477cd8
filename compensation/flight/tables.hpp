// What `kphi fly` prints: the paper's three tables with ours beside them, and the percentiles of a study.
#pragma once

#include <string>

#include "compensation/flight/study.hpp"

namespace kphi::flight {

/// Flights with no legs were not flown; their rows are left out, and a table without rows is empty.
[[nodiscard]] std::string hover_table(const NineFlights& flights);
[[nodiscard]] std::string height_table(const NineFlights& flights, const Gains& gains);
[[nodiscard]] std::string forward_table(const NineFlights& flights);

[[nodiscard]] std::string findings_table(const Findings& findings);
[[nodiscard]] std::string not_reproduced();

/// ë = kP e + kD ė of the height [m/s²].
[[nodiscard]] inline double height_demand(const Gains& gains, double error, double error_rate) noexcept {
  return gains.position.z() * error + gains.velocity.z() * error_rate;
}

}  // namespace kphi::flight
