// What is wrong with a device or a file, or worth knowing, and what to do about it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kphi {

enum class Severity : std::uint8_t { note, warning, fault };

[[nodiscard]] constexpr std::string_view name_of(Severity severity) noexcept {
  constexpr std::string_view names[] = {"note", "warning", "fault"};
  return names[static_cast<int>(severity)];
}

struct Finding {
  Severity severity = Severity::note;  ///< fault: do not measure, do not spin; warning: the results are doubtful
  std::string what;
  std::string next_move;  ///< empty: nothing to do
  friend bool operator==(const Finding&, const Finding&) = default;

  /// "what; next move"
  [[nodiscard]] std::string words() const { return what + (next_move.empty() ? "" : "; ") + next_move; }
  /// "warning: what; next move"
  [[nodiscard]] std::string line() const { return std::string(name_of(severity)) + ": " + words(); }
};

/// Keeps the order among equals.
inline void put_worst_first(std::vector<Finding>& findings) {
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
}

}  // namespace kphi
