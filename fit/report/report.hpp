// report.html: one self-contained page, read by browsers as HTML and by tests as XML. No script, nothing loaded from
// elsewhere; figures are inline SVG.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/coefficients/coefficients.hpp"
#include "fit/propellers/claims.hpp"
#include "fit/report/gnuplot.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// Tables of the page, each with its heading; empty if the data have none. Rejected points, budget, predictions, k
/// against speed, tests, torque; and the paper's statements about several propellers.
[[nodiscard]] std::string analysis_sections(const Analysis& analysis);
[[nodiscard]] std::string claims_section(std::span<const Claim> claims);

/// The same arguments (and SVG files) give the same bytes.
[[nodiscard]] std::string format_report(const Identification& identification, const Provenance& provenance,
                                        const Figures& figures, const Analysis* analysis = nullptr);

/// One campaign on a page of several.
struct Chapter {
  Identification identification;
  Provenance provenance;
  Figures figures;
  std::optional<Analysis> analysis{};
};

/// Several campaigns on one page: first their comparison with the figure `family` (and, if all have an analysis, the
/// paper's statements about several propellers), then each of them.
[[nodiscard]] std::string format_reports(const std::vector<Chapter>& chapters, const Figures& family);

}  // namespace kphi::fit
