// How the report looks, on screen and on paper.
#pragma once

namespace kphi::fit {

/// The page's style sheet: loads nothing, no script.
[[nodiscard]] const char* report_style();

}  // namespace kphi::fit
