// Names of keys: their unit, and the known key that an unknown one was meant to be.
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

/// The one of `names` with the fewest typing errors from `name`, if these are few for its length.
[[nodiscard]] std::optional<std::string> nearest_name(const std::string& name, const std::vector<std::string>& names);

/// The one of `names` that is `name` but for the unit: dwell_ms or dwell → dwell_s.
[[nodiscard]] std::optional<std::string> same_but_for_unit(const std::string& name,
                                                           const std::vector<std::string>& names);

}  // namespace kphi::profiles
