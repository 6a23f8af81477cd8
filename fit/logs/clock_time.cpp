#include "fit/logs/clock_time.hpp"

#include <charconv>
#include <chrono>

#include "base/number.hpp"

namespace kphi::fit {
namespace {

constexpr double kDay = 86400;

/// Days since 1970 of "2024-05-01"; of a date in another order, which only tells that there is one, 0.
std::optional<double> days_of(std::string_view date) {
  int parts[3]{};
  const char* at = date.data();
  const char* const end = at + date.size();
  for (int i = 0; i < 3; ++i) {
    const auto [next, error] = std::from_chars(at, end, parts[i]);
    if (error != std::errc() || (i < 2 && (next == end || (*next != '-' && *next != '/' && *next != '.'))))
      return std::nullopt;
    at = i < 2 ? next + 1 : next;
  }
  if (at != end) return std::nullopt;
  const auto day = std::chrono::year{parts[0]} / parts[1] / parts[2];
  return parts[0] > 1900 && day.ok() ? static_cast<double>(std::chrono::sys_days(day).time_since_epoch().count()) : 0.0;
}

}  // namespace

std::optional<double> clock_seconds(std::string_view field) {
  while (!field.empty() && (field.back() == ' ' || field.back() == 'Z')) field.remove_suffix(1);
  double days = 0;
  if (const std::size_t gap = field.find_first_of("T "); gap != std::string_view::npos) {
    const auto date = days_of(field.substr(0, gap));
    if (!date) return std::nullopt;
    days = *date;
    field.remove_prefix(gap + 1);
  }
  const std::size_t first = field.find(':');
  if (first == std::string_view::npos) return std::nullopt;
  const std::size_t second = field.find(':', first + 1);
  const auto hours = parse_integer<int>(field.substr(0, first));
  const auto minutes =
      parse_integer<int>(field.substr(first + 1, second == std::string_view::npos ? second : second - first - 1));
  const auto seconds = second == std::string_view::npos ? std::optional(0.0) : parse_finite(field.substr(second + 1));
  if (!hours || !minutes || !seconds || *hours < 0 || *hours > 24 || *minutes < 0 || *minutes > 59 ||
      !(*seconds >= 0 && *seconds < 61))
    return std::nullopt;
  return days * kDay + 3600.0 * *hours + 60.0 * *minutes + *seconds;
}

}  // namespace kphi::fit
