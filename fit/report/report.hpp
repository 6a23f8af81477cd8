// report.html: one self-contained page, read by browsers as HTML and by tests as XML. No script, nothing loaded from
// elsewhere; figures are inline SVG.
#pragma once

#include <optional>
#include <string>

#include "fit/coefficients/coefficients.hpp"
#include "fit/report/figures.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// The same arguments (and SVG files) give the same bytes.
[[nodiscard]] std::string format_report(const Identification& identification, const Provenance& provenance,
                                        const Figures& figures, const Analysis* analysis = nullptr);

/// One campaign of a page of several.
struct Chapter {
  Identification identification;
  Provenance provenance;
  Figures figures;
  std::optional<Analysis> analysis{};
};

/// Several campaigns on one page: what they have in common first, `family` is the figure of all, then each by itself.
/// With analyses of all, the claims that only several propellers can test.
[[nodiscard]] std::string format_reports(const std::vector<Chapter>& chapters, const Figures& family);

/// "1.5500e-06 ± 1.2e-09": the value to the second digit of its standard error; without one, six digits.
[[nodiscard]] std::string with_error(double value, double standard_error);

}  // namespace kphi::fit
