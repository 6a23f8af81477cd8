// Tells whether gnuplot, which draws kphi's figures, is installed.
#pragma once

#include <cstdlib>

namespace kphi::test {

[[nodiscard]] inline bool gnuplot_is_installed() { return std::system("command -v gnuplot >/dev/null 2>&1") == 0; }

}  // namespace kphi::test
