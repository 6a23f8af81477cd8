// What an unquoted YAML scalar is: true or false, a number, text, or one of the traps.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace kphi::profiles {

struct Scalar {
  nlohmann::json value;  ///< null if refused
  std::string what;      ///< why it is refused; empty if it is not
  std::string next_move;
};

[[nodiscard]] Scalar read_plain_scalar(const std::string& text);

}  // namespace kphi::profiles
