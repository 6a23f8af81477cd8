// Text and drawings made safe for a page that is read as XML as well as HTML.
#pragma once

#include <string>
#include <string_view>

namespace kphi::fit {

/// & < > " ' escaped; control characters and bytes that are no UTF-8 become U+FFFD, so that the page stays well formed
/// whatever a name holds.
[[nodiscard]] std::string html_escaped(std::string_view text);

/// Escaped, with what plain text writes in ASCII as a page can: K_T and k_i with their index, φ, ω², °, N/RPM².
[[nodiscard]] std::string typeset(std::string_view text);

/// "1.550197e-06 ± 2.7e-11" as people write it: (1.550197 ± 0.000027) × 10⁻⁶, with a true minus. An error that is not
/// known is left out.
[[nodiscard]] std::string with_power_of_ten(double value, double error);

/// An SVG file as an element to put into a page: without XML declaration and doctype, with `prefix` before every id and
/// every reference to one, so that two figures on a page do not mix. Empty when the text is no SVG.
[[nodiscard]] std::string inline_svg(std::string_view svg, const std::string& prefix);

/// The style sheet of the report, on screen and on paper: loads nothing, no script.
[[nodiscard]] const char* report_style();

}  // namespace kphi::fit
