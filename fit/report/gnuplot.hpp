// Figures by gnuplot: a script with its data inside, the same data as CSV beside it, and the SVG that a child process
// draws from them.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace kphi::fit {

struct Figure {
  std::string name;     ///< file name without ending
  std::string caption;  ///< plain text
  std::string script;   ///< gnuplot, data inside
  std::string csv;      ///< the data
};

struct DrawnFigure {
  std::string caption;
  std::filesystem::path svg;
};

struct Figures {
  std::vector<DrawnFigure> drawn;
  std::string skipped;  ///< why figures are missing; empty when all are drawn
};

/// Writes name.gp, name.csv and name.svg into `folder` (made if missing) for every figure, up to the first that gnuplot
/// refuses. Throws RecordError when the folder cannot be written.
[[nodiscard]] Figures draw(const std::vector<Figure>& wanted, const std::filesystem::path& folder,
                           const std::string& gnuplot = "gnuplot");

/// Runs `program` with `script` as its stdin and writes its stdout to `svg`, without a shell. User settings
/// (~/.gnuplot) are not read, so that the same script gives the same bytes. Returns why it could not be drawn and what
/// to do about it; empty if it was. A failure leaves no `svg` behind.
[[nodiscard]] std::string draw(const std::filesystem::path& script, const std::filesystem::path& svg,
                               const std::string& program = "gnuplot");

/// Okabe and Ito's colours, which differ for every kind of colour vision, each with a shape for prints in grey.
struct Mark {
  const char* colour;
  int shape;  ///< gnuplot's point type
};
[[nodiscard]] Mark mark(std::size_t i);

/// The head of every gnuplot script.
[[nodiscard]] std::string figure_head(int height = 470, int width = 800);

/// A named block of inline data.
[[nodiscard]] std::string data_block(const std::string& name, const std::string& rows);

/// A row of a figure's CSV: numbers as short as they can be read back, text as it is.
[[nodiscard]] std::string csv_cell(double value);
[[nodiscard]] std::string csv_cell(std::string_view text);
template <class... Cells>
[[nodiscard]] std::string csv_row(const Cells&... cells) {
  std::string row = (("," + csv_cell(cells)) + ...) + "\n";
  return row.substr(1);
}

/// One `plot` command of several curves.
[[nodiscard]] std::string plot(const std::vector<std::string>& curves);

}  // namespace kphi::fit
