#include "fit/report/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/number.hpp"
#include "base/statistics.hpp"
#include "compensation/units.hpp"
#include "fit/model/torque_power.hpp"
#include "fit/propellers/claims.hpp"

namespace kphi::fit {
namespace {

using Curves = std::vector<std::string>;

constexpr int kHalf =
    600;  // width of a figure that stands beside another: its words are then as large as those of a whole

double rpm(double speed_rad_s) { return to_rpm(RadPerSec(speed_rad_s)); }

std::string symmetric_axis(double reach) {
  return fmt::format("set yrange [{:.6g}:{:.6g}]\nset xzeroaxis lt 1 lc rgb '#999999'\n", -reach, reach);
}

/// Half of a symmetric axis: the largest |value|, rounded up to a tick.
double axis_reach(const std::vector<double>& values, double least) {
  double most = least;
  for (const double value : values) most = std::max(most, std::abs(value));
  const double reach = std::max(least, 1.1 * most);
  const double unit = std::pow(10, std::floor(std::log10(reach)));
  return reach <= unit ? unit : 2 * unit * std::ceil(reach / unit / 2);
}

// ---- the paper's figure ------------------------------------------------------------------------------------

/// Lowest share in the figure: 0, or lower where samples are, since near zero thrust their noise reaches below. Highest
/// share, with room for its box.
std::pair<double, double> share_range(const Identification& identification, const std::vector<ThrustShares>& shares) {
  const compensation::ThrustCurve curve = identification.curve();
  double bottom = 0, top = 100 * std::max(1.0, curve.at(Radians(0)) / curve.thrust_coefficient());
  for (const auto& entry : shares) {
    for (const double percent : entry.percent) {
      bottom = std::min(bottom, percent);
      top = std::max(top, percent);
    }
  }
  return {10 * std::floor(bottom / 10), 10 * std::ceil((top + 3) / 10)};
}

/// The curve with its 95 % interval, by the whole budget.
std::string curve_rows(const std::vector<CurveBand>& band, double from_deg, double to_deg) {
  std::string rows;
  for (const auto& [phi, k, expanded] : band)
    if (phi >= from_deg && phi <= to_deg)
      rows += fmt::format("{:.6g} {:.8g} {:.8g} {:.8g}\n", phi, k * 1e6, (k - expanded) * 1e6, (k + expanded) * 1e6);
  return rows;
}

std::string share_axes(const Identification& identification, const std::vector<ThrustShares>& shares) {
  const auto& table = identification.table;
  const auto [bottom, top] = share_range(identification, shares);
  const double K_T = identification.thrust_coefficient().value;
  double gap = 60;  // boxes are as wide as the angles allow without touching
  std::string tics;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (i > 0) gap = std::min(gap, table[i].phi_deg - table[i - 1].phi_deg);
    tics += fmt::format("{}'{}°' {}", i == 0 ? "" : ", ", csv_cell(table[i].phi_deg), csv_cell(table[i].phi_deg));
  }
  const double width = 0.4 * gap;
  return fmt::format(
      "set border 11\nset xrange [{:.6g}:{:.6g}]\nset yrange [{:.6g}:{:.6g}]\nset y2range [{:.8g}:{:.8g}]\n"
      "set xtics ({})\nset ytics 20\nset y2tics\nset boxwidth {:.6g} absolute\n"
      "set xlabel 'angle of the occlusion φ'\nset ylabel 'thrust, % of the thrust at φ = 0'\n"
      "set y2label 'k(φ), 10⁻⁶ N/(rad/s)²'\n"
      "set key top right samplen 2 spacing 1.2\n"
      "set style fill solid 0.45 border lc rgb '#3b6ea5'\n"
      "set style boxplot range 1.5 outliers pointtype 7\nset pointsize 0.3\n",
      table.front().phi_deg - 1.2 * width, table.back().phi_deg + 1.2 * width, bottom, top, bottom / 100 * K_T * 1e6,
      top / 100 * K_T * 1e6, tics, width);
}

/// Another campaign and the paper behind the paper's figure: data, curves, and what the caption says.
void add_ghosts(const Identification& identification, const DrawnBeside& beside, Figure& figure, std::string& data,
                Curves& curves) {
  if (beside.earlier != nullptr) {
    const Identification& one = beside.earlier->identification;
    std::string points, fitted;
    for (std::size_t i = 0; i < one.table.size(); ++i) {
      const double phi = one.table[i].phi_deg, expanded = beside.earlier->analysis.coefficients[i].expanded();
      points += fmt::format("{:.6g} {:.8g} {:.8g}\n", phi, one.table[i].k * 1e6, expanded * 1e6);
      figure.csv += csv_row(std::string("earlier_k_n_s2_per_rad2"), phi, one.table[i].k, expanded);
      if (!one.alone() && phi >= one.first_fitted_deg())
        fitted += fmt::format("{:.6g} {:.8g}\n", phi, one.curve().at(from_degrees(phi)).value() * 1e6);
    }
    data += data_block("earlier", points) + data_block("earlier_line", fitted);
    if (!fitted.empty())
      curves.push_back("$earlier_line using 1:2 axes x1y2 with lines dt 3 lw 1.5 lc rgb '#767676' notitle");
    curves.push_back(
        "$earlier using 1:2:3 axes x1y2 with yerrorbars pt 6 ps 1.1 lw 1.2 lc rgb '#767676' title 'earlier campaign'");
    figure.caption += fmt::format(" Grey rings: k of an earlier campaign, {}.", beside.earlier_words);
  }
  const auto said = beside.paper ? paper_shares_of(identification) : std::span<const PaperShare>();
  if (said.empty()) return;
  std::string rows, words;
  for (const PaperShare& one : said) {
    rows += fmt::format("{:g} {:g}\n", one.phi_deg, 100 * one.share);
    figure.csv += csv_row(std::string("paper_percent"), one.phi_deg, 100 * one.share, std::string());
    words += fmt::format("{}{} at {:g}°", words.empty() ? "" : " and ", one.words, one.phi_deg);
  }
  data += data_block("paper", rows);
  curves.push_back("$paper using 1:2 with points pt 12 ps 1.8 lw 1.8 lc rgb '#6a3fc0' title 'the paper'");
  figure.caption += fmt::format(" Diamonds: the paper's values of this propeller, {}.", words);
}

Figure share_figure(const Fitted& fitted, const std::vector<ThrustShares>& shares, const DrawnBeside& beside) {
  const Identification& identification = fitted.identification;
  const bool at = identification.at_speed_rad_s > 0;
  Figure figure{
      "thrust_share",
      fmt::format("Thrust in percent of the thrust without occlusion (left axis{}) and the coefficient k(φ) over all "
                  "speeds (right axis, bars and band: 95 %). The boxes hold single samples of the load cell (step "
                  "means where the run files are missing): most of their height is vibration, which averages out. "
                  "The fitted k(φ) is solid between the measured occlusions and dashed below them.",
                  at ? fmt::format(", at {:.0f} RPM", rpm(identification.at_speed_rad_s)) : ""),
      {},
      "kind,phi_deg,value,expanded_95\n"};
  Curves curves{
      "$line using 1:3:4 axes x1y2 with filledcurves fs transparent solid 0.2 noborder lc rgb '#D55E00' notitle"};
  std::string data, coefficients;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    std::string rows;
    for (const double percent : shares[i].percent) {
      rows += fmt::format("{:.6g}\n", percent);
      figure.csv += csv_row(std::string("thrust_percent"), shares[i].phi_deg, percent, std::string());
    }
    if (rows.empty()) continue;
    data += data_block(fmt::format("share{}", i), rows);
    curves.push_back(fmt::format("$share{} using ({}):1 with boxplot lc rgb '#3b6ea5' fillcolor rgb '#a9c6e6' {}", i,
                                 csv_cell(shares[i].phi_deg),
                                 curves.size() == 1 ? "title 'thrust, samples'" : "notitle"));
  }
  for (std::size_t i = 0; i < identification.table.size(); ++i) {
    const double phi = identification.table[i].phi_deg, k = identification.table[i].k,
                 expanded = fitted.analysis.coefficients[i].expanded();
    figure.csv += csv_row(std::string("k_n_s2_per_rad2"), phi, k, expanded);
    coefficients += fmt::format("{:.6g} {:.8g} {:.8g}\n", phi, k * 1e6, expanded * 1e6);
  }
  const double first = identification.first_fitted_deg(), last = identification.table.back().phi_deg;
  data += data_block("line", curve_rows(fitted.analysis.band, first, last)) +
          data_block("before", curve_rows(fitted.analysis.band, 0, first)) + data_block("k", coefficients);
  curves.insert(
      curves.end(),
      {"$before using 1:2 axes x1y2 with lines dt 2 lw 1.5 lc rgb '#D55E00' notitle",
       "$line using 1:2 axes x1y2 with lines lw 2.5 lc rgb '#D55E00' title 'fitted k(φ)'",
       "$k using 1:2:3 axes x1y2 with yerrorbars pt 7 ps 0.6 lw 1.4 lc rgb '#222222' title 'k of each occlusion'"});
  add_ghosts(identification, beside, figure, data, curves);
  figure.script = figure_head() + data + share_axes(identification, shares) + plot(curves);
  return figure;
}

// ---- how well the model holds ------------------------------------------------------------------------------

/// Thrust over squared speed at every φ, with the fits, and below it the residuals.
Figure thrust_figure(const Identification& identification) {
  Figure figure{"thrust_over_speed",
                "Thrust over squared speed with the fits T = k ω², one colour per occlusion, and the residuals below. "
                "Residuals that curve with speed come from the model, not from noise. Steps left out are not shown.",
                {},
                "phi_deg,speed_rad_s,thrust_n,fitted_n\n"};
  std::string data;
  Curves fits, residual_plots;
  std::vector<double> residuals;
  for (std::size_t i = 0; i < identification.table.size(); ++i) {
    const OcclusionCoefficient& row = identification.table[i];
    const ThrustFit& fit = *row.fit;
    std::string points;
    for (const Point& point : fit.points) {
      const double fitted = thrust(fit.parameters, point.speed_rad_s);
      residuals.push_back(1e3 * (point.thrust_n - fitted));
      points += fmt::format("{:.8g} {:.8g} {:.8g}\n", point.speed_rad_s * point.speed_rad_s * 1e-6, point.thrust_n,
                            residuals.back());
      figure.csv += csv_row(row.phi_deg, point.speed_rad_s, point.thrust_n, fitted);
    }
    const double end = fit.speed_max_rad_s;
    const auto [colour, shape] = mark(i);
    data += data_block(fmt::format("points{}", i), points);
    data += data_block(fmt::format("fit{}", i), fmt::format("0 {:.8g}\n{:.8g} {:.8g}\n", fit.parameters.offset,
                                                            end * end * 1e-6, thrust(fit.parameters, end)));
    fits.push_back(fmt::format("$fit{} using 1:2 with lines lw 1.6 lc rgb '{}' notitle", i, colour));
    fits.push_back(fmt::format("$points{} using 1:2 with points pt {} ps 0.45 lc rgb '{}' title 'φ = {}°'", i, shape,
                               colour, csv_cell(row.phi_deg)));
    residual_plots.push_back(
        fmt::format("$points{} using 1:3 with points pt {} ps 0.4 lc rgb '{}' notitle", i, shape, colour));
  }
  figure.script = figure_head(520, kHalf) + data +
                  "set multiplot\nset lmargin at screen 0.12\nset rmargin at screen 0.97\n"
                  "set tmargin at screen 0.97\nset bmargin at screen 0.42\n"
                  "set xrange [0:*]\nset yrange [*<0:*]\nset format x ''\nset ylabel 'thrust T, N'\n"
                  "set key top left samplen 1 spacing 1.2\n" +
                  plot(fits) +
                  "set tmargin at screen 0.38\nset bmargin at screen 0.14\nset format x '%g'\n"
                  "set xlabel 'ω², 10⁶ (rad/s)²'\nset ylabel 'T − k ω², mN'\nunset key\n" +
                  symmetric_axis(axis_reach(residuals, 1)) + plot(residual_plots) + "unset multiplot\n";
  return figure;
}

/// T/ω² of each level against the k of the range, in percent.
Figure speed_figure(const Identification& identification) {
  Figure figure{
      "k_over_speed",
      "k at each speed relative to the k fitted over all of them, a panel for each occlusion (mean and standard "
      "error of the repetitions). Flat lines support T = k ω²; a slope means that k depends on speed.",
      {},
      "phi_deg,speed_rpm,k_n_s2_per_rad2,standard_error,percent_of_fitted\n"};
  std::string data, panels;
  std::vector<double> deviations, reaches;
  const std::size_t last = identification.table.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) {
    const OcclusionCoefficient& row = identification.table[i];
    std::map<double, std::vector<Point>> levels;  // by commanded speed
    for (const results::StepMean& step : row.measured)
      if (step.speed_rad_s > 0) levels[level(step)].push_back({step.speed_rad_s, step.thrust_n, 1});
    std::string rows;
    for (const auto& [at, points] : levels) {
      const auto [k, u, mean_speed, repetitions] = k_at_speed(points);
      const double error = repetitions > 1 ? u : 0;
      deviations.push_back(100 * (k / row.k - 1));
      reaches.push_back(std::abs(deviations.back()) + 100 * error / row.k);
      rows += fmt::format("{:.6g} {:.6g} {:.6g}\n", rpm(at), deviations.back(), 100 * error / row.k);
      figure.csv += csv_row(row.phi_deg, rpm(at), k, error, deviations.back());
    }
    const auto [colour, shape] = mark(i);
    data += data_block(fmt::format("k{}", i), rows);
    panels +=
        fmt::format("{}{}set label 1 'φ = {}°' at graph 0.985, graph 0.86 right tc rgb '#222222'\n",
                    i > 0 ? "unset label 2\n" : "", i == last ? "set format x '%g'\nset xlabel 'speed, RPM'\n" : "",
                    csv_cell(row.phi_deg)) +
        plot({"0 with lines lw 0.6 lc rgb '#999999' notitle",
              fmt::format("$k{} using 1:2:3 with yerrorbars pt {} ps 0.5 lw 0.8 lc rgb '{}' notitle", i, shape, colour),
              fmt::format("$k{} using 1:2 with lines lw 1 lc rgb '{}' notitle", i, colour)});
  }
  const double reach = axis_reach(reaches, 1);
  figure.script =
      figure_head(520, kHalf) + data + symmetric_axis(reach) +
      fmt::format("set format x ''\nset xrange [0:*]\nset ytics {0:.6g},{1:.6g},{1:.6g}\n", -reach / 2, reach / 2) +
      "set label 2 'k at one speed relative to k of the range, %' at screen 0.018, "
      "screen 0.5 center rotate by 90\n" +
      fmt::format("set multiplot layout {},1 margins 0.15,0.94,0.14,0.97 spacing 0.02\n", last + 1) + panels +
      "unset multiplot\n";
  return figure;
}

/// k of each repetition against that of its occlusion, in percent, with two standard errors.
Figure repetition_figure(const Identification& identification) {
  Figure figure{"repetitions",
                "k of each repetition relative to the k of its occlusion, with two standard errors of its own steps. "
                "Repetitions further apart than their bars mean that something changed between the runs.",
                {},
                "phi_deg,repetition,k_n_s2_per_rad2,standard_error,percent_of_all\n"};
  std::map<int, std::string> series;
  std::string tics, data;
  for (std::size_t i = 0; i < identification.table.size(); ++i) {
    const OcclusionCoefficient& row = identification.table[i];
    tics += fmt::format("{}'{}°' {}", tics.empty() ? "" : ", ", csv_cell(row.phi_deg), i);
    std::map<int, std::vector<Point>> runs;
    for (const results::StepMean& step : row.measured)
      runs[step.repetition].push_back({step.speed_rad_s, step.thrust_n, 1});
    for (const auto& [repetition, points] : runs) {
      if (points.size() < 2) continue;
      const ThrustFit fit = fit_thrust(points);
      const double percent = 100 * (fit.parameters.k / row.k - 1);
      const double dodge = 0.14 * (repetition - (1.0 + static_cast<double>(runs.rbegin()->first)) / 2);
      series[repetition] += fmt::format("{:.4g} {:.6g} {:.6g}\n", static_cast<double>(i) + dodge, percent,
                                        200 * fit.standard_error.k / row.k);
      figure.csv += csv_row(row.phi_deg, repetition, fit.parameters.k, fit.standard_error.k, percent);
    }
  }
  Curves curves;
  for (const auto& [repetition, rows] : series) {
    const auto [colour, shape] = mark(static_cast<std::size_t>(repetition));
    data += data_block(fmt::format("repetition{}", repetition), rows);
    curves.push_back(
        fmt::format("$repetition{} using 1:2:3 with yerrorbars pt {} ps 0.8 lw 1.2 lc rgb '{}' title 'repetition {}'",
                    repetition, shape, colour, repetition));
  }
  figure.script = figure_head(360, kHalf) + data +
                  fmt::format("set xrange [-0.6:{}]\nset xtics ({})\nset xzeroaxis lt 1 lc rgb '#999999'\n",
                              static_cast<double>(identification.table.size()) - 0.4, tics) +
                  "set offsets 0, 0, graph 0.1, graph 0.1\n"
                  "set xlabel 'angle of the occlusion φ'\nset ylabel 'k of one run relative to all, %'\n"
                  "set key outside top center horizontal samplen 1\n" +
                  plot(curves);
  return figure;
}

/// Thrust per electrical power over the thrust, one curve per φ; without steps whose power was not measured.
Figure power_figure(const Identification& identification) {
  Figure figure{"power",
                "Grams of thrust per watt over the thrust, one colour per occlusion, mean of the repetitions.",
                {},
                "phi_deg,step,speed_rpm,thrust_n,power_w,gram_per_watt\n"};
  std::map<double, std::string> by_angle;
  for (const StepPower& row : power_of(identification.selection.used)) {
    by_angle[row.phi_deg] += fmt::format("{:.8g} {:.6g}\n", row.thrust_n, row.gram_per_watt());
    figure.csv +=
        csv_row(row.phi_deg, row.step + 1, rpm(row.speed_rad_s), row.thrust_n, row.power_w, row.gram_per_watt());
  }
  std::string data;
  Curves curves;
  for (const auto& [phi_deg, rows] : by_angle) {
    const std::size_t i = curves.size();
    data += data_block(fmt::format("power{}", i), rows);
    curves.push_back(fmt::format("$power{} using 1:2 with linespoints pt {} ps 0.5 lw 1.2 lc rgb '{}' title 'φ = {}°'",
                                 i, mark(i).shape, mark(i).colour, csv_cell(phi_deg)));
  }
  figure.script = figure_head(360, kHalf) + data +
                  "set xrange [0:*]\nset yrange [0:*]\nset xlabel 'thrust, N'\nset ylabel 'thrust per power, g/W'\n"
                  "set key top right samplen 1 spacing 1.2\n" +
                  plot(curves);
  return figure;
}

/// Speed above thrust over time, from `from_s` on.
Figure over_time(const Settling& shown, Figure figure, double from_s, const std::string& marks, const char* time) {
  std::string speed, thrust;
  for (const Settling::Sample& sample : shown.speed_rad_s) {
    speed += fmt::format("{:.5g} {:.8g}\n", sample.time_s, rpm(sample.value));
    figure.csv += csv_row(std::string("speed_rad_s"), sample.time_s, sample.value);
  }
  for (const Settling::Sample& sample : shown.thrust_n) {
    thrust += fmt::format("{:.5g} {:.8g}\n", sample.time_s, sample.value);
    figure.csv += csv_row(std::string("thrust_n"), sample.time_s, sample.value);
  }
  figure.script =
      figure_head(440, kHalf) + data_block("speed", speed) + data_block("thrust", thrust) + marks +
      fmt::format(
          "set multiplot\nset lmargin at screen 0.17\nset rmargin at screen 0.97\nunset key\nset xrange [{:.6g}:*]\n",
          from_s) +
      "set tmargin at screen 0.97\nset bmargin at screen 0.60\nset format x ''\nset ylabel 'speed, RPM' offset 1\n" +
      plot({"$speed using 1:2 with lines lw 1.4 lc rgb '#0072B2'"}) +
      fmt::format("set tmargin at screen 0.55\nset bmargin at screen 0.18\nset format x '%g'\nset xlabel '{}'\n",
                  time) +
      "set ylabel 'thrust, N'\n" + plot({"$thrust using 1:2 with lines lw 1.2 lc rgb '#D55E00'"}) + "unset multiplot\n";
  return figure;
}

Figure settling_figure(const Settling& settling) {
  Figure figure{"settling",
                fmt::format("Response of {} to one speed command: how the speed reaches {:.0f} RPM and the thrust "
                            "follows. The grey span was averaged; everything before it was discarded.",
                            settling.run, rpm(settling.commanded_rad_s)),
                {},
                "kind,time_s,value\n"};
  return over_time(settling, std::move(figure), -0.15,
                   fmt::format("set object 1 rectangle from {:.6g}, graph 0 to {:.6g}, graph 1 behind fillcolor rgb "
                               "'#eef1f4' fillstyle solid noborder\n"
                               "set arrow 1 from 0, graph 0 to 0, graph 1 nohead dt 2 lc rgb '#777777'\n",
                               settling.window_begin_s, settling.window_end_s),
                   "time since the command, s");
}

Figure run_figure(const Settling& whole) {
  Figure figure{"whole_run",
                fmt::format("Speed and thrust of all of {}, from its first zero to its last.", whole.run),
                {},
                "kind,time_s,value\n"};
  return over_time(whole, std::move(figure), 0, "", "time since the beginning of the run, s");
}

/// No quote and no control character: gnuplot would take them for the end of the title.
std::string title_of(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '\'' || static_cast<unsigned char>(c) < 0x20; }, ' ');
  return "title '" + name + "'";
}

}  // namespace

std::vector<ThrustShares> shares_of_steps(const Identification& identification) {
  std::vector<ThrustShares> shares;
  for (const OcclusionCoefficient& row : identification.table) {
    if (!row.at_speed) continue;
    ThrustShares entry{row.phi_deg, {}};
    for (const results::StepMean& step : row.measured)
      if (same_level(level(step), identification.at_speed_rad_s)) entry.percent.push_back(step.thrust_n);
    shares.push_back(std::move(entry));
  }
  if (shares.empty() || shares.front().phi_deg != 0) return {};
  const double nominal = mean(shares.front().percent);
  if (!(nominal > 0)) return {};
  for (auto& entry : shares)
    for (double& value : entry.percent) value *= 100 / nominal;
  return shares;
}

Figure family_figure(std::span<const Fitted> family) {
  Figure figure{"family",
                "Left: k(φ) of every propeller as fitted, with 95 % intervals. Right: the same as a share of its "
                "own K_T; propellers that coincide there lose the same share of thrust.",
                {},
                "propeller,phi_deg,k_n_s2_per_rad2,expanded_95,share_of_K_T\n"};
  std::string data;
  Curves absolute, relative;
  for (std::size_t i = 0; i < family.size(); ++i) {
    const Identification& one = family[i].identification;
    const double K_T = one.thrust_coefficient().value;
    const compensation::ThrustCurve curve = one.curve();
    std::string points, fitted;
    for (std::size_t j = 0; j < one.table.size(); ++j) {
      const OcclusionCoefficient& row = one.table[j];
      const double share = row.k / K_T, expanded = family[i].analysis.coefficients[j].expanded();
      points += fmt::format("{:.6g} {:.8g} {:.8g} {:.8g} {:.8g}\n", row.phi_deg, row.k * 1e6, 1e6 * expanded, share,
                            expanded / K_T);
      figure.csv += csv_row(one.propeller, row.phi_deg, row.k, expanded, share);
      const ThrustCoefficient flown = curve.at(from_degrees(row.phi_deg));
      if (row.phi_deg >= one.first_fitted_deg())
        fitted += fmt::format("{:.6g} {:.8g} {:.8g}\n", row.phi_deg, flown.value() * 1e6, flown.value() / K_T);
    }
    data += data_block(fmt::format("points{}", i), points) + data_block(fmt::format("line{}", i), fitted);
    const auto add = [&](Curves& curves, int value, int error, int column, const std::string& title) {
      const auto [colour, shape] = mark(i);
      curves.push_back(fmt::format("$line{} using 1:{} with lines lw 1.8 lc rgb '{}' notitle", i, column, colour));
      curves.push_back(fmt::format("$points{} using 1:{}:{} with yerrorbars pt {} ps 0.8 lw 1.2 lc rgb '{}' {}", i,
                                   value, error, shape, colour, title));
    };
    add(absolute, 2, 3, 2, title_of(one.propeller));
    add(relative, 4, 5, 3, "notitle");
  }
  figure.script = figure_head(450) + data +
                  "set multiplot layout 1, 2\nset xrange [-15:*<285]\nset yrange [0:*]\n"
                  "set xtics 45\nset xlabel 'angle of the occlusion φ, °'\nset key top right samplen 1 spacing 1.2\n"
                  "set ylabel 'k(φ), 10⁻⁶ N/(rad/s)²'\n" +
                  plot(absolute) + "set ylabel 'k(φ) / K_T'\nset yrange [0:1.1]\nunset key\n" + plot(relative) +
                  "unset multiplot\n";
  return figure;
}

Figures draw_figures(const Fitted& fitted, const std::vector<ThrustShares>& shares, const std::filesystem::path& folder,
                     const std::string& gnuplot, const DrawnBeside& beside) {
  const Identification& identification = fitted.identification;
  std::vector<Figure> wanted;
  if (!identification.alone()) wanted.push_back(share_figure(fitted, shares, beside));
  if (std::ranges::all_of(identification.table, [](const auto& row) { return row.fit.has_value(); })) {
    wanted.push_back(thrust_figure(identification));
    wanted.push_back(speed_figure(identification));
    const bool repeated =
        std::ranges::any_of(identification.table, [](const auto& row) { return row.repetitions > 1; });
    if (repeated || !identification.alone()) wanted.push_back(repetition_figure(identification));
  }
  if (!power_of(identification.selection.used).empty()) wanted.push_back(power_figure(identification));
  if (beside.settling != nullptr && !beside.settling->thrust_n.empty())
    wanted.push_back(settling_figure(*beside.settling));
  if (beside.whole != nullptr && !beside.whole->thrust_n.empty()) wanted.push_back(run_figure(*beside.whole));
  return draw(wanted, folder, gnuplot);
}

}  // namespace kphi::fit
