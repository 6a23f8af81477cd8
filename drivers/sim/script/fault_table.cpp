#include "drivers/sim/script/fault_table.hpp"

#include <charconv>
#include <cmath>

#include "base/number.hpp"

namespace kphi::sim {

double fault_number(std::string_view key, const std::string& text) {
  if (text == "true" || text == "false") return text == "true" ? 1 : 0;
  const char* const last = text.data() + text.size();
  if (text.starts_with("0x")) {
    std::uint32_t bits = 0;
    const auto [end, error] = std::from_chars(text.data() + 2, last, bits, 16);
    if (error == std::errc{} && end == last) return bits;
  }
  const auto value = parse_double(text);
  if (!value || !std::isfinite(*value))
    throw FaultEntryError(std::string(key), fmt::format("\"{}\" is not a number", text));
  return *value;
}

double fault_number(std::string_view key, const std::string& text, const FaultRange& range) {
  const double value = fault_number(key, text);
  if (!(value >= range.low && value <= range.high))
    throw FaultEntryError(std::string(key), fmt::format("{} is outside {} to {}", value, range.low, range.high));
  if (range.whole && value != std::floor(value))
    throw FaultEntryError(std::string(key), fmt::format("{} is not a whole number", value));
  return value;
}

}  // namespace kphi::sim
