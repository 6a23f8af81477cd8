// Names of keys: the unit at their end, and the key that somebody meant who wrote another one.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace kphi::profiles {

/// A key without its unit and the unit in words: dwell_s → {"dwell", "s"}, steps → {"steps", ""}.
struct KeyParts {
  std::string stem;
  std::string unit;
};
[[nodiscard]] KeyParts split_unit(const std::string& key);

/// The one of `names` that differs from `name` by the fewest slips of the finger, if that is few for its length.
[[nodiscard]] std::optional<std::string> nearest_name(const std::string& name, const std::vector<std::string>& names);

/// The one of `names` that is `name` but for the unit: dwell_ms or dwell → dwell_s.
[[nodiscard]] std::optional<std::string> same_but_for_unit(const std::string& name,
                                                           const std::vector<std::string>& names);

}  // namespace kphi::profiles
