// Files that are no table of text.
#pragma once

#include <string>
#include <string_view>

namespace kphi::fit {

/// `begin`: its first bytes. Throws ConfigurationError with the next move for a workbook, an archive, a log of a flight
/// stack, and at a NUL.
void refuse_other_formats(std::string_view begin, const std::string& path);

}  // namespace kphi::fit
