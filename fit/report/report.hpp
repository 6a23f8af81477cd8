// report.html: one self-contained page, read by browsers as HTML and by tests as XML. No script, nothing loaded from
// elsewhere; figures are inline SVG.
#pragma once

#include <span>
#include <string>

#include "fit/coefficients/coefficients.hpp"
#include "fit/propellers/history.hpp"
#include "fit/report/gnuplot.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// What the page shows of one campaign beside the numbers.
struct Chapter {
  Provenance provenance;
  Figures figures;
  std::string drawing{};  ///< SVG of the stand and its plates; empty: nobody described a stand
  std::string vehicle{};  ///< what the verdict is on a vehicle, in words, and
  std::string shapes{};   ///< SVG of its shapes; empty: nobody named one
  bool claims = false;    ///< the paper's statements that this propeller alone can test
};

/// The same arguments (and SVG files) give the same bytes.
[[nodiscard]] std::string format_report(const Fitted& fitted, const Chapter& chapter);

/// Several campaigns on one page, a chapter each: first their comparison with the figure `together` and the paper's
/// statements about several propellers, then each of them. With a `history`, of one propeller: first how its campaigns
/// changed over time.
[[nodiscard]] std::string format_reports(std::span<const Fitted> family, std::span<const Chapter> chapters,
                                         const Figures& together, const History* history = nullptr);

}  // namespace kphi::fit
