// What is wrong with a box, or worth knowing, and what to do about it.
#pragma once

#include <cstdint>
#include <string>

namespace kphi::netbox {

enum class Severity : std::uint8_t { note, warning, fault };

struct Finding {
  Severity severity = Severity::note;  ///< fault: do not measure; warning: measure with doubt
  std::string what;
  std::string next_move;  ///< empty: nothing to do
  friend bool operator==(const Finding&, const Finding&) = default;
};

}  // namespace kphi::netbox
