#include "examples/second_bench/checked_lines.hpp"

#include <fmt/format.h>

#include "base/number.hpp"

namespace kphi::second_bench {
namespace {

constexpr std::size_t kLongest = 100;  // more without a newline is noise

/// The words of a line whose checksum holds.
std::optional<std::string_view> words_of(std::string_view line) {
  while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  if (line.size() < 4 || line.front() != '$' || line[line.size() - 3] != '*') return std::nullopt;
  const std::string_view words = line.substr(1, line.size() - 4);
  return checked(std::string(words)).substr(words.size() + 2, 2) == line.substr(line.size() - 2) ? std::optional(words)
                                                                                                 : std::nullopt;
}

std::optional<std::vector<std::int64_t>> numbers_of(std::string_view words, char letter, std::size_t count) {
  if (words.size() < 2 || words[0] != letter || words[1] != ',') return std::nullopt;
  std::vector<std::int64_t> numbers;
  for (words.remove_prefix(2);;) {
    const std::size_t comma = words.find(',');
    const auto number = parse_integer<std::int64_t>(words.substr(0, comma));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    if (comma == std::string_view::npos) break;
    words.remove_prefix(comma + 1);
  }
  return numbers.size() == count ? std::optional(numbers) : std::nullopt;
}

}  // namespace

std::string checked(const std::string& words) {
  std::uint8_t sum = 0;
  for (const char c : words) sum ^= static_cast<std::uint8_t>(c);
  return fmt::format("${}*{:02X}\n", words, sum);
}

void CheckedLines::take(std::string_view bytes) { heard_ += bytes; }

std::optional<std::vector<std::int64_t>> CheckedLines::next(char letter, std::size_t numbers) {
  for (std::size_t end; (end = heard_.find('\n')) != std::string::npos;) {
    const std::string line = heard_.substr(0, end);
    heard_.erase(0, end + 1);
    if (const auto words = words_of(line))
      if (auto found = numbers_of(*words, letter, numbers)) return found;
    ++malformed_;
  }
  if (heard_.size() > kLongest) {
    heard_.clear();
    ++malformed_;
  }
  return std::nullopt;
}

}  // namespace kphi::second_bench
