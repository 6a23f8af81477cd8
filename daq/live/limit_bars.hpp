// The limits that the page draws as bars: value beside limit. One table; whoever combines limits otherwise fills it so.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "daq/interlock.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq::live {

/// A limit whose passing stops the run.
struct LimitBar {
  std::string key;   ///< with its unit, "thrust_n"
  std::string name;  ///< for people, "Thrust"
  std::string unit;  ///< for people, "N"
  double limit = 0;
  std::function<double(const Observation&)> value;  ///< in the same unit; not finite: unknown
};

/// Those of a campaign.
[[nodiscard]] std::vector<LimitBar> limit_bars(const profiles::Limits& limits);

}  // namespace kphi::daq::live
