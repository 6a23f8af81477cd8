// What a box says of itself, fit for a terminal and for JSON.
#pragma once

#include <string>
#include <string_view>

namespace kphi::netbox {

/// UTF-8 in, the same out; control characters, and bytes that are no UTF-8, become U+FFFD each.
[[nodiscard]] std::string printable(std::string_view text);

}  // namespace kphi::netbox
