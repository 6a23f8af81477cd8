// Draws one figure: gnuplot as a child process, script on stdin, SVG on stdout. No shell is involved.
#pragma once

#include <filesystem>
#include <string>

namespace kphi::fit {

struct GnuplotOutcome {
  bool drawn = false;
  std::string reason;  ///< why not, and what to do about it
};

/// Runs `program` with `script` as its stdin and writes what it prints to `svg`. User settings (~/.gnuplot) are not
/// read, so that the same script gives the same bytes. A failure leaves no `svg` behind.
[[nodiscard]] GnuplotOutcome draw(const std::filesystem::path& script, const std::filesystem::path& svg,
                                  const std::string& program = "gnuplot");

}  // namespace kphi::fit
