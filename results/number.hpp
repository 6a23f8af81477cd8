// Numbers in files: the shortest text that reads back as the same bits, with a dot, whatever the locale.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace kphi::results {

/// Shortest round trip (std::to_chars): 45, 1e-06, nan.
[[nodiscard]] std::string shortest(double value);

/// As `shortest`, but every YAML 1.1 and 1.2 reader takes it for a float: the mantissa has a '.', the exponent a sign
/// (45.0, 1.0e-06, 1.0e+300). Throws std::invalid_argument for NaN and infinities.
[[nodiscard]] std::string yaml_number(double value);

/// The whole of `text` as a number (std::from_chars); nothing for anything else, "" and " 1" included.
[[nodiscard]] std::optional<double> parse_double(std::string_view text);

}  // namespace kphi::results
