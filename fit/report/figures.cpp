#include "fit/report/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/number.hpp"
#include "compensation/units.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/model/power.hpp"
#include "fit/report/gnuplot.hpp"
#include "results/file_layer.hpp"

namespace kphi::fit {
namespace {


constexpr std::array<Mark, 7> kMarks{{{"#0072B2", 7},
                                      {"#D55E00", 5},
                                      {"#009E73", 9},
                                      {"#CC79A7", 13},
                                      {"#E69F00", 11},
                                      {"#56B4E9", 15},
                                      {"#444444", 6}}};

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

/// Highest share in the figure, with room for its box.
double share_top(const Identification& identification, const std::vector<ThrustShares>& shares) {
  const compensation::ThrustCurve curve = identification.curve();
  double top = 100 * std::max(1.0, curve.at(Radians(0)) / curve.thrust_coefficient());
  for (const auto& entry : shares)
    for (const double percent : entry.percent) top = std::max(top, percent);
  return 10 * std::ceil((top + 3) / 10);
}

/// 0, or lower where samples are: near no thrust at all their noise reaches below.
double share_bottom(const std::vector<ThrustShares>& shares) {
  double bottom = 0;
  for (const auto& entry : shares)
    for (const double percent : entry.percent) bottom = std::min(bottom, percent);
  return 10 * std::floor(bottom / 10);
}

std::string curve_rows(const compensation::ThrustCurve& curve, double from_deg, double to_deg) {
  constexpr int kPieces = 60;
  std::string rows;
  for (int i = 0; i <= kPieces; ++i) {
    const double phi = from_deg + (to_deg - from_deg) * i / kPieces;
    const double k = curve.at(from_degrees(phi)).value(), band = 2 * curve.standard_error_at(from_degrees(phi));
    rows += fmt::format("{:.6g} {:.8g} {:.8g} {:.8g}\n", phi, k * 1e6, (k - band) * 1e6, (k + band) * 1e6);
  }
  return rows;
}

std::string coefficient_rows(const Identification& identification) {
  std::string rows;
  for (const auto& row : identification.table)
    rows += fmt::format("{:.6g} {:.8g} {:.8g}\n", row.phi_deg, row.k * 1e6, 2 * row.standard_error * 1e6);
  return rows;
}

std::string angle_tics(const Identification& identification) {
  std::string tics;
  for (const auto& row : identification.table)
    tics += fmt::format("{}'{}°' {}", tics.empty() ? "" : ", ", shortest(row.phi_deg), shortest(row.phi_deg));
  return tics;
}

/// Boxes as wide as the angles allow without touching.
double box_width(const Identification& identification) {
  double gap = 60;
  for (std::size_t i = 1; i < identification.table.size(); ++i)
    gap = std::min(gap, identification.table[i].phi_deg - identification.table[i - 1].phi_deg);
  return 0.4 * gap;
}

std::string axes(const Identification& identification, double bottom, double top) {
  const double width = box_width(identification);
  return fmt::format(
      "set xrange [{:.6g}:{:.6g}]\nset yrange [{:.6g}:{:.6g}]\nset y2range [{:.8g}:{:.8g}]\n"
      "set xtics ({})\nset ytics 20\nset y2tics\nset boxwidth {:.6g} absolute\n"
      "set xlabel 'angle of the occlusion φ'\nset ylabel 'thrust, % of the thrust at φ = 0'\n"
      "set y2label 'k(φ), 10⁻⁶ N/(rad/s)²'\n"
      "set key top right samplen 2 spacing 1.2\n"
      "set style fill solid 0.45 border lc rgb '#3b6ea5'\n"
      "set style boxplot range 1.5 outliers pointtype 7\nset pointsize 0.3\n",
      identification.table.front().phi_deg - 1.2 * width, identification.table.back().phi_deg + 1.2 * width, bottom,
      top, bottom / 100 * identification.line.K_T * 1e6, top / 100 * identification.line.K_T * 1e6,
      angle_tics(identification), width);
}

std::string box_plots(const std::vector<ThrustShares>& shares) {
  std::string parts;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (shares[i].percent.empty()) continue;
    parts += fmt::format("  $share{} using ({}):1 with boxplot lc rgb '#3b6ea5' fillcolor rgb '#a9c6e6' {}, \\\n", i,
                         shortest(shares[i].phi_deg), parts.empty() ? "title 'thrust'" : "notitle");
  }
  return parts;
}

bool write_and_draw(const Figure& figure, const std::filesystem::path& folder, const std::string& gnuplot,
                    Figures& figures) {
  results::MemoryOnlySync files;  // drawn again at any time from steps.csv
  results::write_text(folder / (figure.name + ".gp"), figure.script, files);
  results::write_text(folder / (figure.name + ".csv"), figure.csv, files);
  const std::filesystem::path svg = folder / (figure.name + ".svg");
  const GnuplotOutcome outcome = draw(folder / (figure.name + ".gp"), svg, gnuplot);
  if (outcome.drawn) figures.drawn.push_back({figure.caption, svg});
  if (!outcome.drawn) figures.skipped = outcome.reason;
  return outcome.drawn;
}

}  // namespace

std::vector<ThrustShares> shares_of_steps(const Identification& identification) {
  std::vector<ThrustShares> shares;
  for (const OcclusionCoefficient& row : identification.table) {
    if (!row.at_speed) continue;
    ThrustShares entry{row.phi_deg, {}};
    for (const results::StepMean& step : identification.selection.used) {
      const bool there = same_level(level(step), identification.at_speed_rad_s);
      if (step.occlusion_deg == row.phi_deg && there) entry.percent.push_back(step.thrust_n);
    }
    shares.push_back(std::move(entry));
  }
  if (shares.empty() || shares.front().phi_deg != 0 || !(mean(shares.front().percent) > 0)) return {};
  const double nominal = mean(shares.front().percent);
  for (auto& entry : shares)
    for (double& value : entry.percent) value *= 100 / nominal;
  return shares;
}

Figure share_figure(const Identification& identification, const std::vector<ThrustShares>& shares) {
  const LineFit& line = identification.line;
  const compensation::ThrustCurve curve = identification.curve();
  Figure figure;
  figure.name = "thrust_share";
  figure.caption = "Thrust in percent of the thrust without occlusion (boxes, left axis";
  if (identification.at_speed_rad_s > 0)
    figure.caption += fmt::format(", at {:.0f} RPM", to_rpm(RadPerSec(identification.at_speed_rad_s)));
  figure.caption +=
      ") and the angle-dependent coefficient k(φ) over all speeds (right axis, two standard errors). The line is solid "
      "where it was measured.";
  figure.csv = "kind,phi_deg,value,standard_error\n";
  std::string data;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    std::string rows;
    for (const double percent : shares[i].percent) {
      rows += fmt::format("{:.6g}\n", percent);
      figure.csv += fmt::format("thrust_percent,{},{},\n", shortest(shares[i].phi_deg), shortest(percent));
    }
    if (!rows.empty()) data += data_block(fmt::format("share{}", i), rows);
  }
  for (const auto& row : identification.table) {
    figure.csv +=
        fmt::format("k_n_s2_per_rad2,{},{},{}\n", shortest(row.phi_deg), shortest(row.k), shortest(row.standard_error));
  }
  const double first = line.points.front().phi_deg, last = line.points.back().phi_deg;
  data += data_block("line", curve_rows(curve, first, std::max(last, first + 1e-3)));
  data += data_block("before", curve_rows(curve, 0, first));
  data += data_block("k", coefficient_rows(identification));
  figure.script =
      figure_head() + "set border 11\n" + data +
      axes(identification, share_bottom(shares), share_top(identification, shares)) + "plot \\\n" +
      "  $line using 1:3:4 axes x1y2 with filledcurves fs transparent solid 0.2 noborder lc rgb '#D55E00' notitle, "
      "\\\n" +
      box_plots(shares) +
      "  $before using 1:2 axes x1y2 with lines dt 2 lw 1.5 lc rgb '#D55E00' notitle, \\\n"
      "  $line using 1:2 axes x1y2 with lines lw 2.5 lc rgb '#D55E00' title 'line k(φ)', \\\n"
      "  $k using 1:2:3 axes x1y2 with yerrorbars pt 7 ps 0.6 lw 1.4 lc rgb '#222222' title 'k of each occlusion'\n";
  return figure;
}

Figures draw(const std::vector<Figure>& wanted, const std::filesystem::path& folder, const std::string& gnuplot) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);  // what failed shows at the first file
  Figures figures;
  for (const Figure& figure : wanted)
    if (!write_and_draw(figure, folder, gnuplot, figures)) break;
  return figures;
}

Mark mark(std::size_t i) { return kMarks[i % kMarks.size()]; }

std::string figure_head(int height) {
  return fmt::format(
      "set terminal svg size 800,{} noenhanced font 'Helvetica,Arial,sans-serif,14' linewidth 1.2 background "
      "'#ffffff'\n"
      "set encoding utf8\nset minussign\n"
      "set border 3 lc rgb '#777777'\n"
      "set tics nomirror out scale 0.6 textcolor rgb '#333333'\n"
      "set grid ytics lc rgb '#e4e4e4' lt 1 lw 0.8\n"
      "set key opaque fillcolor rgb '#ffffff' noenhanced\n",
      height);
}

/// A named block of inline data.
std::string data_block(const std::string& name, const std::string& rows) {
  return fmt::format("${} << EOD\n{}EOD\n", name, rows);
}

}  // namespace kphi::fit
