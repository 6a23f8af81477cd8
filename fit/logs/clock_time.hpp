// A time of day, or a date with one, in the time column of a log.
#pragma once

#include <optional>
#include <string_view>

namespace kphi::fit {

/// "12:30:05.25", "2024-05-01T12:30:05Z", "2024-05-01 12:30:05", "05/01/2024 12:30:05" → seconds since some midnight,
/// dates counted where they are given year first; nullopt for anything else.
[[nodiscard]] std::optional<double> clock_seconds(std::string_view field);

}  // namespace kphi::fit
