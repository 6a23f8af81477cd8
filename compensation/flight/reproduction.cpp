#include "compensation/flight/reproduction.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "compensation/flight/tables.hpp"

namespace kphi::flight {
namespace {

using Of = std::function<double(const LegResult&)>;

/// Where a number stands in the flights, and which way of it is the paper's.
struct Asked {
  std::string row, what;
  double paper;
  ExperimentIndex flight;
  std::size_t leg;
  Of of;
  bool is_error;  ///< smaller is better
  Reason reason;  ///< why it may not come out
};

void ask_hover(std::vector<Asked>& all) {
  static constexpr const char* kAxes[] = {"|x| [m]", "|y| [m]", "|z| [m]"};
  for (const HoverRow& row : kHoverRows) {
    const std::string name = "Table I   " + std::string(row.start) + " -> " + std::string(row.final);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      all.push_back({name, kAxes[axis], row.paper[static_cast<std::size_t>(axis)], row.flight, row.leg,
                     [axis](const LegResult& leg) { return std::fabs(leg.mean_error[axis]); }, row.final != "X",
                     row.final == "X" ? Reason::in_x
                     : axis == 2      ? Reason::height
                                      : Reason::sideways});
    }
  }
}

void ask_height(std::vector<Asked>& all, const Gains& gains) {
  for (const HeightRow& row : kHeightRows) {
    const std::string name = "Table II  " + std::string(row.start) + " -> " + std::string(row.final);
    all.push_back({name, "e [m]", row.error, row.flight, row.leg,
                   [](const LegResult& leg) { return leg.mean_error.z(); }, false,
                   row.error < 0 ? Reason::sign_of_height : Reason::height});
    all.push_back({name, "e' [m/s]", row.error_rate, row.flight, row.leg,
                   [](const LegResult& leg) { return leg.mean_error_rate.z(); }, false, Reason::velocity_term});
    all.push_back(
        {name, "e'' [m/s2]", row.acceleration, row.flight, row.leg,
         [gains](const LegResult& leg) { return height_demand(gains, leg.mean_error.z(), leg.mean_error_rate.z()); },
         false, Reason::velocity_term});
  }
}

void ask_forward(std::vector<Asked>& all) {
  for (const ForwardRow& row : kForwardRows) {
    const struct {
      const char* name;
      const std::optional<ForwardCell>& cell;
    } cells[] = {{"X", row.x}, {"O n.c.", row.o_plain}, {"O c.", row.o_compensated}};
    for (const auto& [name, cell] : cells) {
      if (!cell) continue;
      const bool in_x = std::string(name) == "X";
      const std::string title = "Table III " + std::string(row.title) + ", " + name;
      all.push_back({title, "mean [m]", cell->mean, row.flight, cell->leg,
                     [](const LegResult& leg) { return leg.mean_distance; }, !in_x,
                     in_x ? Reason::in_x : Reason::circles});
      all.push_back({title, "std. dev. [m]", cell->deviation, row.flight, cell->leg,
                     [](const LegResult& leg) { return leg.deviation; }, false, in_x ? Reason::in_x : Reason::scatter});
    }
  }
}

std::optional<double> number_in(const NineFlights& flights, const Asked& asked) {
  const FlightResult& flight = flights[asked.flight];
  if (flight.leg_count == 0 || (flight.lost && asked.leg >= flight.lost_leg)) return std::nullopt;
  return asked.of(flight.legs[asked.leg]);
}

Reproduced judged(const PaperCell& cell, bool is_error) {
  if (cell.draws == 0) return Reproduced::unknown;
  const double low = cell.spread.p10, high = cell.spread.p90;
  if (cell.paper >= low && cell.paper <= high) return Reproduced::within;
  return is_error && high < cell.paper ? Reproduced::better : Reproduced::not_reproduced;
}

std::string number(const std::optional<double>& value) { return value ? words("%9.4f", *value) : "     lost"; }

}  // namespace

std::vector<PaperCell> paper_cells(const NineFlights& bench, const NineFlights& world, const std::vector<Draw>& draws,
                                   const Gains& gains) {
  std::vector<Asked> all;
  ask_hover(all);
  ask_height(all, gains);
  ask_forward(all);
  std::vector<PaperCell> cells;
  for (const Asked& asked : all) {
    if (world[asked.flight].leg_count == 0) continue;
    PaperCell cell{asked.row, asked.what, asked.paper, number_in(bench, asked), number_in(world, asked)};
    std::vector<double> values;
    for (const Draw& draw : draws) {
      if (const auto value = number_in(draw.flights, asked)) values.push_back(*value);
    }
    cell.draws = values.size();
    cell.spread = percentiles(std::move(values));
    cell.reproduced = judged(cell, asked.is_error);
    cell.reason = asked.reason;
    cells.push_back(std::move(cell));
  }
  return cells;
}

std::string reproduction_table(const std::vector<PaperCell>& cells, double gamma) {
  const bool drawn = !cells.empty() && cells[0].draws > 0;
  std::string text = words("Beside the paper's Tables I to III%s\n%-42s %-14s %9s %9s %9s",
                           drawn ? "; within: the paper lies between p10 and p90 of the draws"
                                 : "; --draws 300 tells how far the numbers spread",
                           "", "", "paper", "gamma 1", words("gamma %g", gamma).c_str());
  if (drawn) text += "       p10      p50      p90";
  text += "\n";
  for (const PaperCell& cell : cells) {
    text += words("%-42s %-14s %9.4f", cell.row.c_str(), cell.what.c_str(), cell.paper) + " " + number(cell.bench) +
            " " + number(cell.world);
    if (drawn) text += words(" %9.4f%9.4f%9.4f", cell.spread.p10, cell.spread.p50, cell.spread.p90);
    text += std::string("  ") + name_of(cell.reproduced);
    if (cell.reproduced == Reproduced::not_reproduced) text += std::string(" (") + letter_of(cell.reason) + ")";
    text += "\n";
  }
  return text + "\n";
}

std::vector<Reason> reasons_of(const std::vector<PaperCell>& cells) {
  std::vector<Reason> reasons;
  for (std::size_t i = 0; i < kReasons.size(); ++i) {
    const auto reason = static_cast<Reason>(i);
    const bool counts = std::any_of(cells.begin(), cells.end(), [&](const PaperCell& cell) {
      return cell.reason == reason &&
             (cell.reproduced == Reproduced::unknown || cell.reproduced == Reproduced::not_reproduced);
    });
    if (counts) reasons.push_back(reason);
  }
  return reasons;
}

std::string not_reproduced(const std::vector<PaperCell>& cells) {
  const bool drawn = !cells.empty() && cells[0].draws > 0;
  std::string text;
  for (const Reason reason : reasons_of(cells))
    text +=
        std::string("(") + letter_of(reason) + ") " + std::string(kReasons[static_cast<std::size_t>(reason)]) + "\n";
  if (text.empty()) return text;
  return (drawn ? "Not reproduced:\n"
                : "Not reproduced: --draws 300 tells which; a number that is not, for this reason:\n") +
         text;
}

std::vector<CogSign> signs_of_cog(const Scene& nominal, const Shadow& shadow) {
  std::vector<CogSign> signs;
  const Eigen::Vector2d offs[] = {{0, 0}, {1e-3, 0.5e-3}, {1e-3, -0.5e-3}, {-1e-3, 0.5e-3}, {-1e-3, -0.5e-3}};
  for (const Eigen::Vector2d& off : offs) {
    Scene scene = nominal;
    scene.truth.cog_error = off;
    const Merits merits = merits_of(fly_all(scene, shadow));
    signs.push_back({off, merits.hover_xy_plain, merits.hover_xy_ratio(), merits.forward_ratio()});
  }
  return signs;
}

std::string cog_table(const std::vector<CogSign>& signs) {
  std::string text =
      "What a millimetre of the centre of gravity does: x and y are no test of the compensation\n"
      "off x, y [mm]   hover xy n.c. [m]   c./n.c.   forward c./n.c.\n";
  for (const CogSign& sign : signs) {
    text += words("%+5.1f %+5.1f %19.3f %10.2f %17.2f\n", 1e3 * sign.cog_error.x(), 1e3 * sign.cog_error.y(),
                  sign.hover_xy_plain, sign.hover_xy_ratio, sign.forward_ratio);
  }
  return text + "\n";
}

}  // namespace kphi::flight
