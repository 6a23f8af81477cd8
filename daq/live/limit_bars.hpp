// The guard's table as the page draws it: value beside limit, and who set it. What is in it, and which of several
// limits is the tightest, is guard_limits.hpp's to say; here is how an onlooker reads each quantity.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "daq/progress.hpp"

namespace kphi::daq::live {

/// A limit whose passing stops the run.
struct LimitBar {
  Watched watched{};
  std::string key;   ///< with its unit, "thrust_n"
  std::string name;  ///< for people, short: "Thrust"
  std::string unit;  ///< for people, "N"
  double limit = 0;
  bool lower = false;  ///< passed when the value is below it
  std::string source;  ///< "campaign limits.thrust_max_n"
};

/// In the order of the table.
[[nodiscard]] std::vector<LimitBar> limit_bars(const std::vector<GuardLimit>& limits);
[[nodiscard]] const char* key_of(Watched watched);
/// 1: at the limit; more: beyond it. Not finite: unknown.
[[nodiscard]] double share_of(const LimitBar& bar, double value);

/// What cannot be told by what is seen alone.
struct Moment {
  bool settled = false;  ///< the speed has had its time since it was commanded
  Duration pause{0};     ///< of the runner, since it looked last; bench time
};
/// Of everything watched, by Watched, in the units of the guard's table; NaN: unknown, no longer fresh, or not judged
/// now.
using LimitValues = std::array<double, kWatchedCount>;
[[nodiscard]] LimitValues limit_values(const Position& position, const Observation& seen, const Moment& moment,
                                       const Clock& clock);

}  // namespace kphi::daq::live
