#include "compensation/flight/tables.hpp"

#include <cmath>

#include "compensation/flight/text.hpp"

namespace kphi::flight {
namespace {

bool flown(const FlightResult& flight) { return flight.leg_count > 0; }
bool valid(const FlightResult& flight, std::size_t leg) { return !flight.lost || leg < flight.lost_leg; }

std::string headed(const std::string& head, const std::string& rows) { return rows.empty() ? "" : head + rows + "\n"; }

std::string spread(double mean, double deviation) { return aligned(mean, 3, 6) + " ±" + aligned(deviation, 3, 5); }

std::string forward_cell(const FlightResult& flight, const std::optional<ForwardCell>& cell) {
  if (!cell) return padded("  -", 31);
  const std::string paper = "  (" + spread(cell->paper.mean, cell->paper.deviation) + ") ";
  if (!valid(flight, cell->leg)) return padded("  lost", 14) + paper;
  const LegResult& leg = flight.legs[cell->leg];
  return " " + spread(leg.mean_distance, leg.deviation) + paper;
}

std::string percentile_row(const std::string& title, const Percentiles& p, const std::string& paper) {
  return padded(title, 34) + aligned(p.p10, 3, 9) + aligned(p.p50, 3, 9) + aligned(p.p90, 3, 9) + "   " + paper + "\n";
}

}  // namespace

std::string hover_table(const NineFlights& flights) {
  std::string rows;
  for (const HoverRow& row : kHoverRows) {
    const FlightResult& flight = flights[row.flight];
    if (!flown(flight)) continue;
    rows += padded(std::string(row.start), 8) + padded(std::string(row.final), 8);
    if (valid(flight, row.leg)) {
      const Eigen::Vector3d& error = flight.legs[row.leg].mean_error;
      for (Eigen::Index axis = 0; axis < 3; ++axis) rows += aligned(std::fabs(error[axis]), 4, 8);
      rows += error.z() > 0 ? "  below" : "  above";
    } else {
      rows += padded("    lost", 31);
    }
    rows += "   ";
    for (const double error : row.paper) rows += aligned(error, 4, 8);
    rows += "\n";
  }
  return headed(
      "Table I, hover: |reference - estimate| in the final shape, mean of 4 s [m]\n"
      "start   final        |x|     |y|     |z|  drone   paper |x|     |y|     |z|\n",
      rows);
}

std::string height_table(const NineFlights& flights, const Gains& gains) {
  std::string rows;
  for (const HeightRow& row : kHeightRows) {
    const FlightResult& flight = flights[row.flight];
    if (!flown(flight) || !valid(flight, row.leg)) continue;
    const LegResult& leg = flight.legs[row.leg];
    const double error = leg.mean_error.z(), rate = leg.mean_error_rate.z();
    rows += padded(std::string(row.start), 8) + padded(std::string(row.final), 8) + aligned(error, 4, 8) +
            aligned(rate, 4, 8) + aligned(height_demand(gains, error, rate), 3, 13) + "    " +
            aligned(row.error, 4, 8) + aligned(row.error_rate, 4, 8) + aligned(row.acceleration, 4, 9) +
            aligned(height_demand(gains, row.error, row.error_rate), 4, 13) + "\n";
  }
  return headed("Table II, height: the PD's share of the demand with kP " + shortest(gains.position.z()) + "/s2, kD " +
                    shortest(gains.velocity.z()) +
                    "/s; e = z_ref - z_est [m], e' [m/s], e'' [m/s2]\n"
                    "start   final          e      e'  kP e + kD e'     paper e      e'      e''  kP e + kD e'\n",
                rows);
}

std::string forward_table(const NineFlights& flights) {
  std::string rows;
  for (const ForwardRow& row : kForwardRows) {
    const FlightResult& flight = flights[row.flight];
    if (!flown(flight)) continue;
    rows += padded(std::string(row.title), 21) + forward_cell(flight, row.x) + forward_cell(flight, row.o_plain) +
            forward_cell(flight, row.o_compensated) + "\n";
  }
  return headed(
      "Table III, forward flight: distance to the reference over one lap, mean ± standard deviation [m] (paper)\n"
      "circle               X                              O n.c.                         O c.\n",
      rows);
}

std::string findings_table(const Findings& found) {
  const auto percent = [](double share) { return aligned(100 * share, 1, 0) + " %"; };
  if (found.kept == 0) {
    return std::to_string(found.draws) +
           " draws, and a flight was lost in each: no percentiles (without compensation " +
           std::to_string(found.lost_plain) + ", with or in X " + std::to_string(found.lost_compensated) + ")\n\n";
  }
  std::string text = std::to_string(found.draws) + " draws; with a flight lost: " + std::to_string(found.lost_plain) +
                     " without compensation, " + std::to_string(found.lost_compensated) +
                     " with or in X. Percentiles are over the " + std::to_string(found.kept) + " others.\n" +
                     padded("", 34) + "      p10      p50      p90   paper\n";
  for (std::size_t i = 0; i < kMerits.size(); ++i) {
    if (*kMerits[i].title != '\0') text += percentile_row(kMerits[i].title, found.merits[i], kMerits[i].paper);
  }
  text += "better with compensation: hover z in " + percent(found.hover_z_better) + ", forward flight in " +
          percent(found.forward_better) +
          " of the draws,\ncounting those as better that were lost without compensation only\n";
  for (std::size_t law = 0; law < found.by_law.size(); ++law) {
    const Findings::OfLaw& of = found.by_law[law];
    if (of.kept == 0) continue;
    text += "median c. over n.c., law " + padded(name_of(static_cast<LossLaw>(law)), 18) + "hover z " +
            aligned(of.hover_z_ratio, 2, 0) + ", forward " + aligned(of.forward_ratio, 2, 0) + "\n";
  }
  return text + "\n";
}

std::string not_reproduced() {
  std::string text = "Not reproduced:\n";
  for (const std::string_view& what : kNotReproduced) text += "- " + std::string(what) + "\n";
  return text;
}

}  // namespace kphi::flight
