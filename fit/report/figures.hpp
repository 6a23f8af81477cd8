// The figures of a fit: gnuplot scripts with their data inside, the same data as CSV beside them, and the drawn SVG.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fit/model/identification.hpp"

namespace kphi::fit {

/// Thrust at the top speed at one φ, in percent of the mean thrust at φ = 0.
struct ThrustShares {
  double phi_deg = 0;
  std::vector<double> percent;
};

/// The step means at the speed of "k at speed", one per repetition: what the box plot shows when the raw samples are
/// not at hand. Empty when there is none at φ = 0.
[[nodiscard]] std::vector<ThrustShares> shares_of_steps(const Identification& identification);

struct Figure {
  std::string name;     ///< file name without ending
  std::string caption;  ///< plain text
  std::string script;   ///< gnuplot, data inside
  std::string csv;      ///< the data
};

/// The paper's figure: box plots of the thrust shares over φ, and on the second axis, scaled so that K_T stands at 100
/// %, the coefficients with two standard errors and the line in solid orange (dashed where no occlusion was measured).
[[nodiscard]] Figure share_figure(const Identification& identification, const std::vector<ThrustShares>& shares);

struct DrawnFigure {
  std::string caption;
  std::filesystem::path svg;
};

struct Figures {
  std::vector<DrawnFigure> drawn;
  std::string skipped;  ///< why figures are missing; empty when all are drawn
};

/// Writes name.gp, name.csv and name.svg into `folder` (made if missing) for every figure, up to the first that gnuplot
/// refuses.
[[nodiscard]] Figures draw(const std::vector<Figure>& wanted, const std::filesystem::path& folder,
                           const std::string& gnuplot = "gnuplot");

/// Okabe and Ito's colours: apart for every kind of colour vision. With them a shape, for prints in grey.
struct Mark {
  const char* colour;
  int shape;  ///< gnuplot's point type
};
[[nodiscard]] Mark mark(std::size_t i);

/// How every gnuplot script begins.
[[nodiscard]] std::string figure_head(int height = 470);

/// A named block of inline data.
[[nodiscard]] std::string data_block(const std::string& name, const std::string& rows);

}  // namespace kphi::fit
