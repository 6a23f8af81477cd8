#include "fit/report/flight_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace kphi::fit {
namespace {

constexpr double kDegrees = 180 / kPi;

double widest(const FlownBin& bin) { return *std::ranges::max_element(bin.phi) * kDegrees; }

/// Means over half a second: a figure of 2,000 points that shake shows nothing.
struct Piece {
  double time_s = 0, force = 0, phi_deg = 0, residual = 0, count = 0;
};

std::vector<Piece> pieces_of(const FlightFit& fit, const FlownBins& flown) {
  std::vector<Piece> pieces;
  double until = -1;
  for (std::size_t b = 0; b < flown.bins.size(); ++b) {
    const FlownBin& bin = flown.bins[b];
    if (std::isnan(fit.residuals[b])) continue;
    if (pieces.empty() || bin.time_s > until) {
      pieces.emplace_back();
      until = bin.time_s + 0.5;
    }
    Piece& piece = pieces.back();
    piece.time_s += bin.time_s, piece.force += bin.force, piece.phi_deg += widest(bin);
    piece.residual += fit.residuals[b], ++piece.count;
  }
  for (Piece& piece : pieces)
    for (double* one : {&piece.time_s, &piece.force, &piece.phi_deg, &piece.residual}) *one /= piece.count;
  return pieces;
}

Figure over_time(const std::vector<Piece>& pieces) {
  Figure figure{
      "flight_over_time",
      "Specific force along body z (above) and what the model leaves of it (below), means over half a second; "
      "on the right axis the largest φ of a rotor. Residuals that change with φ mean that k(φ) is no line, "
      "or that an arm is not where its angle says; those that drift mean air, battery or zero.",
      {},
      "time_s,force_m_s2,phi_deg,residual_m_s2\n"};
  std::string rows;
  for (const Piece& one : pieces) {
    rows += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g}\n", one.time_s, one.force, one.phi_deg, one.residual);
    figure.csv += csv_row(one.time_s, one.force, one.phi_deg, one.residual);
  }
  figure.script = figure_head(560) + data_block("flown", rows) +
                  "set multiplot layout 2,1\nset lmargin 10\nset rmargin 8\nset ytics nomirror\nset y2tics\n"
                  "set y2label 'φ, degrees'\nset ylabel 'm/s²'\nset key top right samplen 2\n" +
                  plot({"$flown using 1:3 axes x1y2 with lines lc rgb '#999999' title 'φ'",
                        "$flown using 1:2 with points pt 7 ps 0.35 lc rgb '#0072B2' title 'specific force'"}) +
                  "set xlabel 'time, s'\n" +
                  plot({"$flown using 1:3 axes x1y2 with lines lc rgb '#999999' notitle",
                        "$flown using 1:4 with points pt 7 ps 0.35 lc rgb '#D55E00' title 'residual'"}) +
                  "unset multiplot\n";
  return figure;
}

/// Residuals over φ, and over the collective, which is what the flight excited.
Figure over_excitation(const std::vector<Piece>& pieces) {
  Figure figure{"flight_excitation",
                "What the flight excited, and the residuals there: over the largest φ of a rotor (left) and over the "
                "specific force (right). Where there are no points the flight tells nothing.",
                {},
                "phi_deg,force_m_s2,residual_m_s2\n"};
  std::string rows;
  for (const Piece& one : pieces) {
    rows += fmt::format("{:.6g} {:.6g} {:.6g}\n", one.phi_deg, one.force, one.residual);
    figure.csv += csv_row(one.phi_deg, one.force, one.residual);
  }
  figure.script = figure_head() + data_block("flown", rows) +
                  "set multiplot layout 1,2\nunset key\nset xzeroaxis lt 1 lc rgb '#999999'\n"
                  "set ylabel 'residual, m/s²'\nset xlabel 'largest φ, degrees'\n" +
                  plot({"$flown using 1:3 with points pt 7 ps 0.35 lc rgb '#0072B2'"}) +
                  "set xlabel 'specific force along z, m/s²'\n" +
                  plot({"$flown using 2:3 with points pt 7 ps 0.35 lc rgb '#009E73'"}) + "unset multiplot\n";
  return figure;
}

Figure curves(const FlightFit& fit, const Fitted& fitted, const compensation::Coefficients* bench) {
  Figure figure{"flight_k_over_phi",
                fmt::format("k(φ) of the flight with its 95 % band{}. A factor between the two is mass, accelerometer, "
                            "speed or the bench's cell; another slope is the air about the body.",
                            bench == nullptr ? "" : ", and that of the bench"),
                {},
                "of,phi_deg,k_n_s2_per_rad2,expanded_95\n"};
  std::string rows, beside;
  const auto add = [&](std::string& to, const char* of, double phi, double k, double expanded) {
    to += fmt::format("{:.6g} {:.8g} {:.8g} {:.8g}\n", phi, k * 1e6, (k - expanded) * 1e6, (k + expanded) * 1e6);
    figure.csv += csv_row(std::string(of), phi, k, expanded);
  };
  for (const CurveBand& one : fitted.analysis.band) add(rows, "flight", one.phi_deg, one.k, one.expanded);
  if (bench != nullptr) {
    for (int i = 0; i <= 40; ++i) {
      const double phi = fit.wide_deg() * i / 40;
      const double u = bench->curve.standard_error_at(from_degrees(phi));
      add(beside, "bench", phi, bench->curve.at(from_degrees(phi)).value(), std::isfinite(u) ? 1.96 * u : 0);
    }
  }
  std::vector<std::string> drawn{
      "$flight using 1:3:4 with filledcurves fs transparent solid 0.25 noborder lc rgb '#D55E00' notitle",
      "$flight using 1:2 with lines lw 2.5 lc rgb '#D55E00' title 'flight'"};
  std::string data = data_block("flight", rows);
  if (bench != nullptr) {
    data += data_block("bench", beside);
    drawn.insert(drawn.begin(),
                 "$bench using 1:3:4 with filledcurves fs transparent solid 0.25 noborder lc rgb '#0072B2' notitle");
    drawn.emplace_back("$bench using 1:2 with lines lw 2.5 lc rgb '#0072B2' title 'bench'");
  }
  figure.script = figure_head() + data +
                  "set xlabel 'φ, degrees'\nset ylabel 'k(φ), 10⁻⁶ N/(rad/s)²'\nset key top right\n" + plot(drawn);
  return figure;
}

}  // namespace

std::vector<Figure> flight_figures(const FlightFit& fit, const FlownBins& flown, const Fitted& fitted,
                                   const compensation::Coefficients* bench) {
  const std::vector<Piece> pieces = pieces_of(fit, flown);
  std::vector<Figure> figures{over_time(pieces), over_excitation(pieces)};
  if (!fit.alone()) figures.insert(figures.begin(), curves(fit, fitted, bench));
  return figures;
}

}  // namespace kphi::fit
