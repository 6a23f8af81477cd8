// Tables of Tyto/RCbenchmark thrust stands (Series 1520, 1580/1585, 1780). Units differ between files and stand only in
// the header; which speed is right (electrical needs the motor's pole count) the file does not say.
#pragma once

#include <string>
#include <string_view>

#include "fit/logs/stand_log.hpp"

namespace kphi::fit {

/// Throws ConfigurationError (path:line) when the thrust column, its unit or both speed columns are missing or stand
/// twice. Lines whose thrust is no number are left out and listed.
[[nodiscard]] StandLog read_rcbenchmark(std::string_view text, std::string path);

}  // namespace kphi::fit
