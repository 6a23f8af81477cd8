// One entry of a script of faults as a person writes it, and the numbers in it.
#pragma once

#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace kphi::sim {

/// Names and values as text.
using FaultEntry = std::map<std::string, std::string>;

/// What is wrong in an entry, and at which of its keys; an empty key: the whole entry.
class FaultEntryError : public std::runtime_error {
 public:
  FaultEntryError(std::string at_key, const std::string& what) : std::runtime_error(what), key(std::move(at_key)) {}
  const std::string key;
};

struct FaultRange {
  double low = 0, high = 0;
  bool whole = false;
};

/// The value of `kind`. Throws FaultEntryError.
[[nodiscard]] const std::string& kind_of(const FaultEntry& entry);
/// Finite; "true" and "false" are 1 and 0, "0x1F" is 31. Throws FaultEntryError.
[[nodiscard]] double fault_number(std::string_view key, const std::string& text);
/// Throws FaultEntryError outside of `range`.
[[nodiscard]] double fault_number(std::string_view key, const std::string& text, const FaultRange& range);

}  // namespace kphi::sim
