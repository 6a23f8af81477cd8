// Text and drawings made safe for a page that is read as XML as well as HTML.
#pragma once

#include <string>
#include <string_view>

namespace kphi::fit {

/// & < > " ' escaped; control characters and bytes that are no UTF-8 become U+FFFD, so that the page stays well formed
/// whatever a name holds.
[[nodiscard]] std::string html_escaped(std::string_view text);

/// An SVG file as an element to put into a page: without XML declaration and doctype, with `prefix` before every id and
/// every reference to one, so that two figures on a page do not mix. Empty when the text is no SVG.
[[nodiscard]] std::string inline_svg(std::string_view svg, const std::string& prefix);

}  // namespace kphi::fit
