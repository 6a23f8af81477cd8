// Numbers as SCPI writes them (IEEE 488.2, 7.7.2 and 8.7: NR1, NR2, NR3), whatever the locale is.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace kphi::scpi {

/// Nothing unless the whole text, but for blanks around it, is one finite number. 9.9E37 and 9.91E37, SCPI's infinity
/// and "not a number" (SCPI-99, 7.2.1.4 and 5), are none.
[[nodiscard]] std::optional<double> number_of(std::string_view text) noexcept;

/// With as many decimals as `step` has, rounded to nearest: what is sent is what was meant. `step` > 0.
[[nodiscard]] std::string number_text(double value, double step);

}  // namespace kphi::scpi
