#include "drivers/sim/fault_entry.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdint>

namespace kphi::sim {

const std::string& kind_of(const FaultEntry& entry) {
  const auto named = entry.find("kind");
  if (named == entry.end()) throw FaultEntryError("", "the kind is missing");
  return named->second;
}

double fault_number(std::string_view key, const std::string& text) {
  if (text == "true" || text == "false") return text == "true" ? 1 : 0;
  const char* const last = text.data() + text.size();
  if (text.substr(0, 2) == "0x") {
    std::uint32_t bits = 0;
    const auto [end, error] = std::from_chars(text.data() + 2, last, bits, 16);
    if (error == std::errc{} && end == last) return bits;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), last, value);
  if (error != std::errc{} || end != last || !std::isfinite(value))
    throw FaultEntryError(std::string(key), fmt::format("'{}' is no number", text));
  return value;
}

double fault_number(std::string_view key, const std::string& text, const FaultRange& range) {
  const double value = fault_number(key, text);
  if (!(value >= range.low && value <= range.high))
    throw FaultEntryError(std::string(key), fmt::format("{} is outside {} to {}", value, range.low, range.high));
  if (range.whole && value != std::floor(value))
    throw FaultEntryError(std::string(key), fmt::format("{} is not whole", value));
  return value;
}

}  // namespace kphi::sim
