#include "fit/report/detail_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/number.hpp"
#include "compensation/units.hpp"
#include "fit/model/power.hpp"

namespace kphi::fit {
namespace {

double rpm(double speed_rad_s) { return to_rpm(RadPerSec(speed_rad_s)); }

/// Steps of one φ by the level at which they were asked.
std::map<double, std::vector<const results::StepMean*>> by_level(const Identification& identification, double phi_deg) {
  std::map<double, std::vector<const results::StepMean*>> levels;
  for (const results::StepMean& step : identification.selection.used)
    if (step.occlusion_deg == phi_deg && step.speed_rad_s > 0) levels[level(step)].push_back(&step);
  return levels;
}

struct MeanAndError {
  double mean = 0;
  double error = 0;  ///< s/√n; 0 from one value
};

MeanAndError mean_of(const std::vector<double>& values) {
  MeanAndError result;
  const double n = static_cast<double>(values.size());
  for (const double value : values) result.mean += value / n;
  double squares = 0;
  for (const double value : values) squares += (value - result.mean) * (value - result.mean);
  if (values.size() > 1) result.error = std::sqrt(squares / (n - 1) / n);
  return result;
}

double local_k(const results::StepMean& step) { return step.thrust_n / (step.speed_rad_s * step.speed_rad_s); }

/// Largest |value| that is no outlier, rounded up to a tick: what a symmetric axis must show.
double axis_reach(std::vector<double> values, double least) {
  for (double& value : values) value = std::abs(value);
  std::sort(values.begin(), values.end());
  const double most = values.empty() ? least : values[values.size() - 1 - values.size() / 50];
  const double reach = std::max(least, 1.25 * most);
  const double unit = std::pow(10, std::floor(std::log10(reach)));
  return unit * std::ceil(reach / unit * 2) / 2;
}

/// Points and, from the second block on, a legend entry per φ.
std::string residual_plots(std::size_t count, const char* using_columns) {
  std::string parts;
  for (std::size_t i = 0; i < count; ++i) {
    parts += fmt::format("{}  $points{} using {} with points pt {} ps 0.4 lc rgb '{}' notitle", i == 0 ? "" : ", \\\n",
                         i, using_columns, mark(i).shape, mark(i).colour);
  }
  return parts;
}

bool has_points(const Identification& identification) {
  return std::all_of(identification.table.begin(), identification.table.end(),
                     [](const OcclusionCoefficient& row) { return row.fit.has_value(); });
}

}  // namespace

Figure thrust_figure(const Identification& identification) {
  Figure figure;
  figure.name = "thrust_over_speed";
  figure.caption =
      "Thrust over squared speed with the fits T = k ω², one colour per occlusion, and below it what the fits leave "
      "over. "
      "A residual that bends with speed is the model's, not noise. Steps that were left out are not shown.";
  figure.csv = "phi_deg,speed_rad_s,thrust_n,fitted_n\n";
  std::string data, parts;
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
      figure.csv += fmt::format("{},{},{},{}\n", shortest(row.phi_deg), shortest(point.speed_rad_s),
                                shortest(point.thrust_n), shortest(fitted));
    }
    const double end = fit.speed_max_rad_s;
    data += data_block(fmt::format("points{}", i), points);
    data += data_block(fmt::format("fit{}", i), fmt::format("0 {:.8g}\n{:.8g} {:.8g}\n", fit.parameters.offset,
                                                            end * end * 1e-6, thrust(fit.parameters, end)));
    parts += fmt::format(
        "{}  $fit{} using 1:2 with lines lw 1.6 lc rgb '{}' notitle, \\\n"
        "  $points{} using 1:2 with points pt {} ps 0.45 lc rgb '{}' title 'φ = {}°'",
        i == 0 ? "" : ", \\\n", i, mark(i).colour, i, mark(i).shape, mark(i).colour, shortest(row.phi_deg));
  }
  const double reach = axis_reach(residuals, 1);
  figure.script =
      figure_head(640) + data +
      "set multiplot\nset lmargin at screen 0.1\nset rmargin at screen 0.97\n"
      "set tmargin at screen 0.97\nset bmargin at screen 0.40\n"
      "set xrange [0:*]\nset yrange [*<0:*]\nset format x ''\nset ylabel 'thrust T, N'\n"
      "set key top left samplen 1 spacing 1.2\nplot \\\n" +
      parts +
      "\nset tmargin at screen 0.36\nset bmargin at screen 0.11\nset format x '%g'\n"
      "set xlabel 'ω², 10⁶ (rad/s)²'\nset ylabel 'T − k ω², mN'\nunset key\n" +
      fmt::format("set yrange [{:.6g}:{:.6g}]\nset xzeroaxis lt 1 lc rgb '#999999'\nplot \\\n", -reach, reach) +
      residual_plots(identification.table.size(), "1:3") + "\nunset multiplot\n";
  return figure;
}

Figure speed_figure(const Identification& identification) {
  Figure figure;
  figure.name = "k_over_speed";
  figure.caption =
      "k at each single speed against the k fitted over all of them (mean and standard error of the repetitions). Flat "
      "lines say that T = k ω² is true; a slope means that k belongs to a range of speeds.";
  figure.csv = "phi_deg,speed_rpm,k_n_s2_per_rad2,standard_error,percent_of_fitted\n";
  std::string data, parts;
  std::vector<double> deviations;
  for (std::size_t i = 0; i < identification.table.size(); ++i) {
    const OcclusionCoefficient& row = identification.table[i];
    std::string rows;
    for (const auto& [at, steps] : by_level(identification, row.phi_deg)) {
      std::vector<double> ks;
      for (const results::StepMean* step : steps) ks.push_back(local_k(*step));
      const MeanAndError k = mean_of(ks);
      const double percent = 100 * (k.mean / row.k - 1);
      deviations.push_back(percent);
      rows += fmt::format("{:.6g} {:.6g} {:.6g}\n", rpm(at), percent, 100 * k.error / row.k);
      figure.csv += fmt::format("{},{},{},{},{}\n", shortest(row.phi_deg), shortest(rpm(at)), shortest(k.mean),
                                shortest(k.error), shortest(percent));
    }
    data += data_block(fmt::format("k{}", i), rows);
    parts += fmt::format(
        "{}  $k{} using 1:2:3 with yerrorbars pt {} ps 0.5 lw 0.8 lc rgb '{}' title 'φ = {}°', \\\n"
        "  $k{} using 1:2 with lines lw 1 lc rgb '{}' notitle",
        i == 0 ? "" : ", \\\n", i, mark(i).shape, mark(i).colour, shortest(row.phi_deg), i, mark(i).colour);
  }
  const double reach = axis_reach(deviations, 1);
  figure.script = figure_head() + data +
                  fmt::format("set yrange [{:.6g}:{:.6g}]\nset xzeroaxis lt 1 lc rgb '#999999'\n", -reach, reach) +
                  "set xlabel 'speed, RPM'\nset ylabel 'k at one speed against k of the range, %'\n"
                  "set key bottom right horizontal samplen 1 spacing 1.2\nplot \\\n" +
                  parts + "\n";
  return figure;
}

Figure repetition_figure(const Identification& identification) {
  Figure figure;
  figure.name = "repetitions";
  figure.caption =
      "k of each repetition against the k of its occlusion, with two standard errors of its own steps. Repetitions "
      "that "
      "lie further apart than their bars say that something changed between the runs.";
  figure.csv = "phi_deg,repetition,k_n_s2_per_rad2,standard_error,percent_of_all\n";
  std::map<int, std::string> series;
  std::string tics;
  for (std::size_t i = 0; i < identification.table.size(); ++i) {
    const OcclusionCoefficient& row = identification.table[i];
    tics += fmt::format("{}'{}°' {}", tics.empty() ? "" : ", ", shortest(row.phi_deg), i);
    std::map<int, std::vector<Point>> points;
    for (const results::StepMean& step : identification.selection.used)
      if (step.occlusion_deg == row.phi_deg) points[step.repetition].push_back({step.speed_rad_s, step.thrust_n, 1});
    for (const auto& [repetition, of_run] : points) {
      if (of_run.size() < 2) continue;
      const ThrustFit fit = fit_thrust(of_run);
      const double percent = 100 * (fit.parameters.k / row.k - 1);
      const double dodge = 0.14 * (repetition - (1.0 + static_cast<double>(points.rbegin()->first)) / 2);
      series[repetition] += fmt::format("{:.4g} {:.6g} {:.6g}\n", static_cast<double>(i) + dodge, percent,
                                        200 * fit.standard_error.k / row.k);
      figure.csv += fmt::format("{},{},{},{},{}\n", shortest(row.phi_deg), repetition, shortest(fit.parameters.k),
                                shortest(fit.standard_error.k), shortest(percent));
    }
  }
  std::string data, parts;
  for (const auto& [repetition, rows] : series) {
    const Mark look = mark(static_cast<std::size_t>(repetition));
    data += data_block(fmt::format("repetition{}", repetition), rows);
    parts += fmt::format(
        "{}  $repetition{} using 1:2:3 with yerrorbars pt {} ps 0.8 lw 1.2 lc rgb '{}' title "
        "'repetition {}'",
        parts.empty() ? "" : ", \\\n", repetition, look.shape, look.colour, repetition);
  }
  figure.script = figure_head(400) + data +
                  fmt::format("set xrange [-0.6:{}]\nset xtics ({})\nset xzeroaxis lt 1 lc rgb '#999999'\n",
                              static_cast<double>(identification.table.size()) - 0.4, tics) +
                  "set offsets 0, 0, graph 0.1, graph 0.1\n"
                  "set xlabel 'angle of the occlusion φ'\nset ylabel 'k of one run against all, %'\n"
                  "set key outside top center horizontal samplen 1\nplot \\\n" +
                  parts + "\n";
  return figure;
}

Figure power_figure(const Identification& identification) {
  Figure figure;
  figure.name = "power";
  figure.caption =
      "What thrust costs: grams per watt over the thrust, one colour per occlusion, mean of the repetitions.";
  figure.csv = "phi_deg,step,speed_rpm,thrust_n,power_w,gram_per_watt\n";
  std::map<double, std::string> courses;
  for (const StepPower& row : power_of(identification.selection.used)) {
    courses[row.phi_deg] += fmt::format("{:.8g} {:.6g}\n", row.thrust_n, row.gram_per_watt());
    figure.csv +=
        fmt::format("{},{},{},{},{},{}\n", shortest(row.phi_deg), row.step + 1, shortest(rpm(row.speed_rad_s)),
                    shortest(row.thrust_n), shortest(row.power_w), shortest(row.gram_per_watt()));
  }
  std::string data, parts;
  std::size_t i = 0;
  for (const auto& [phi_deg, rows] : courses) {
    data += data_block(fmt::format("power{}", i), rows);
    parts += fmt::format("{}  $power{} using 1:2 with linespoints pt {} ps 0.5 lw 1.2 lc rgb '{}' title 'φ = {}°'",
                         i == 0 ? "" : ", \\\n", i, mark(i).shape, mark(i).colour, shortest(phi_deg));
    ++i;
  }
  figure.script = figure_head(400) + data +
                  "set xrange [0:*]\nset yrange [0:*]\nset xlabel 'thrust, N'\nset ylabel 'thrust per power, g/W'\n"
                  "set key top right samplen 1 spacing 1.2\nplot \\\n" +
                  parts + "\n";
  return figure;
}

Figure settling_figure(const Settling& settling) {
  Figure figure;
  figure.name = "settling";
  figure.caption = fmt::format(
      "One step of {} from the command on: how the speed reaches {:.0f} RPM and the thrust follows. The grey span was "
      "averaged; what comes before it was discarded.",
      settling.run, rpm(settling.commanded_rad_s));
  figure.csv = "kind,time_s,value\n";
  std::string speed, thrust;
  for (const Settling::Sample& sample : settling.speed_rad_s) {
    speed += fmt::format("{:.5g} {:.8g}\n", sample.time_s, rpm(sample.value));
    figure.csv += fmt::format("speed_rad_s,{},{}\n", shortest(sample.time_s), shortest(sample.value));
  }
  for (const Settling::Sample& sample : settling.thrust_n) {
    thrust += fmt::format("{:.5g} {:.8g}\n", sample.time_s, sample.value);
    figure.csv += fmt::format("thrust_n,{},{}\n", shortest(sample.time_s), shortest(sample.value));
  }
  figure.script =
      figure_head(520) + data_block("speed", speed) + data_block("thrust", thrust) +
      fmt::format(
          "set object 1 rectangle from {:.6g}, graph 0 to {:.6g}, graph 1 behind fillcolor rgb '#eef1f4' "
          "fillstyle solid noborder\n",
          settling.window_begin_s, settling.window_end_s) +
      fmt::format(
          "set multiplot\nset lmargin at screen 0.13\nset rmargin at screen 0.97\nunset key\n"
          "set xrange [{:.6g}:{:.6g}]\nset arrow 1 from 0, graph 0 to 0, graph 1 nohead dt 2 lc rgb '#777777'\n",
          -0.15, settling.window_end_s + 0.05) +
      "set tmargin at screen 0.97\nset bmargin at screen 0.57\nset format x ''\nset ylabel 'speed, RPM' offset 1\n"
      "plot $speed using 1:2 with linespoints pt 7 ps 0.35 lw 1.2 lc rgb '#0072B2'\n"
      "set tmargin at screen 0.53\nset bmargin at screen 0.13\nset format x '%g'\nset xlabel 'time since the command, "
      "s'\n"
      "set ylabel 'thrust, N'\n"
      "plot $thrust using 1:2 with lines lw 1.2 lc rgb '#D55E00'\nunset multiplot\n";
  return figure;
}

Figure family_figure(std::span<const Identification* const> family) {
  Figure figure;
  figure.name = "family";
  figure.caption =
      "k(φ) of every propeller with its line and two standard errors (left), and the same as a share of its own K_T "
      "(right): lines that lie on each other there lose thrust alike.";
  figure.csv = "propeller,phi_deg,k_n_s2_per_rad2,standard_error,share_of_K_T\n";
  std::string data, absolute, relative;
  for (std::size_t i = 0; i < family.size(); ++i) {
    const Identification& one = *family[i];
    const LineFit& line = one.line;
    const compensation::ThrustCurve curve = one.curve();
    std::string points, fitted;
    for (const OcclusionCoefficient& row : one.table) {
      points += fmt::format("{:.6g} {:.8g} {:.8g} {:.8g} {:.8g}\n", row.phi_deg, row.k * 1e6, 2e6 * row.standard_error,
                            row.k / line.K_T, 2 * row.standard_error / line.K_T);
      figure.csv += fmt::format("{},{},{},{},{}\n", one.propeller, shortest(row.phi_deg), shortest(row.k),
                                shortest(row.standard_error), shortest(row.k / line.K_T));
    }
    for (const double phi : {line.points.front().phi_deg, line.points.back().phi_deg})
      fitted += fmt::format("{:.6g} {:.8g} {:.8g}\n", phi, curve.at(from_degrees(phi)).value() * 1e6,
                            curve.at(from_degrees(phi)) / curve.thrust_coefficient());
    data += data_block(fmt::format("points{}", i), points) + data_block(fmt::format("line{}", i), fitted);
    const auto plots = [&](int value, int error, int column, const std::string& title) {
      return fmt::format(
          "{}  $line{} using 1:{} with lines lw 1.8 lc rgb '{}' notitle, \\\n"
          "  $points{} using 1:{}:{} with yerrorbars pt {} ps 0.8 lw 1.2 lc rgb '{}' {}",
          i == 0 ? "" : ", \\\n", i, column, mark(i).colour, i, value, error, mark(i).shape, mark(i).colour, title);
    };
    std::string name = one.propeller;
    std::replace_if(
        name.begin(), name.end(), [](char c) { return c == '\'' || static_cast<unsigned char>(c) < 0x20; }, ' ');
    absolute += plots(2, 3, 2, "title '" + name + "'");
    relative += plots(4, 5, 3, "notitle");
  }
  figure.script = figure_head(450) + data +
                  "set multiplot layout 1, 2\nset xrange [-15:*<285]\nset yrange [0:*]\n"
                  "set xtics 45\nset xlabel 'angle of the occlusion φ, °'\nset key top right samplen 1 spacing 1.2\n"
                  "set ylabel 'k(φ), 10⁻⁶ N/(rad/s)²'\nplot \\\n" +
                  absolute + "\nset ylabel 'k(φ) / K_T'\nset yrange [0:1.1]\nunset key\nplot \\\n" + relative +
                  "\nunset multiplot\n";
  return figure;
}

Figures draw_figures(const Identification& identification, const std::vector<ThrustShares>& shares,
                     const std::filesystem::path& folder, const std::string& gnuplot, const Settling* settling) {
  std::vector<Figure> wanted{share_figure(identification, shares)};
  if (has_points(identification)) {
    wanted.push_back(thrust_figure(identification));
    wanted.push_back(speed_figure(identification));
    wanted.push_back(repetition_figure(identification));
  }
  if (!power_of(identification.selection.used).empty()) wanted.push_back(power_figure(identification));
  if (settling != nullptr && !settling->thrust_n.empty()) wanted.push_back(settling_figure(*settling));
  return draw(wanted, folder, gnuplot);
}

}  // namespace kphi::fit
