#include "fit/report/history_section.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "base/csv.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/report/html.hpp"

namespace kphi::fit {
namespace {

struct Panel {
  const char* axis;
  double scale;   ///< from the chart's values
  double origin;  ///< subtracted before
};

constexpr std::array<Panel, kFollowed.size()> kPanels{
    {{"all k together, %", 100, 1}, {"K_T, 10⁻⁶ N/(rad/s)²", 1e6, 0}, {"slope, 10⁻⁹ N/(rad/s)² per °", 1e9, 0}}};

bool is_named(const Chart& chart, std::size_t i) { return chart.change && chart.change->names(i); }

}  // namespace

Figure history_figure(const History& history) {
  Figure figure{"history",
                "Control charts, one campaign beside the next. Bars are 95 % of what is new in each campaign; the line "
                "is their mean, the band holds 99.7 % of all campaigns of a steady stand. Filled: what a test names.",
                {},
                "quantity,when,name,value,expanded_95,centre,limit\n"};
  std::string data, panels;
  for (std::size_t j = 0; j < history.charts.size(); ++j) {
    const Chart& chart = history.charts[j];
    const auto& [axis, scale, origin] = kPanels[j];
    std::string rows, named;
    for (std::size_t i = 0; i < history.entries.size(); ++i) {
      const HistoryEntry& entry = history.entries[i];
      const Estimate& one = entry.of(chart.quantity);
      const double value = scale * (one.value - origin), centre = scale * (chart.centre.value - origin),
                   limit = scale * chart.limits[i];
      rows += fmt::format("{} {:.8g} {:.8g} {:.8g} {:.8g} {:.8g} {}\n", i, value, scale * expanded(one), centre,
                          centre - limit, centre + limit, entry.when.substr(0, 10));
      if (is_named(chart, i)) named += fmt::format("{} {:.8g}\n", i, value);
      figure.csv += csv_row(name_of(chart.quantity), entry.when, entry.name, one.value, expanded(one),
                            chart.centre.value, chart.limits[i]);
    }
    data += data_block(fmt::format("chart{}", j), rows) + data_block(fmt::format("named{}", j), named);
    std::vector<std::string> curves{
        fmt::format("$chart{} using 1:5:6 with filledcurves fs solid 0.12 noborder lc rgb '#0072B2' notitle", j),
        fmt::format("$chart{} using 1:4 with lines lw 1.4 lc rgb '#0072B2' notitle", j),
        fmt::format("$chart{} using 1:2:3:xtic(7) with yerrorbars pt 6 ps 0.9 lw 1.3 lc rgb '#333333' notitle", j)};
    if (!named.empty())
      curves.push_back(fmt::format("$named{} using 1:2 with points pt 7 ps 1.0 lc rgb '#D55E00' notitle", j));
    panels += fmt::format("set ylabel '{}'\n", axis) + plot(curves);
  }
  figure.script = figure_head(820) + data +
                  fmt::format("set multiplot layout {}, 1\nset xrange [-0.5:{}]\nset xtics rotate by 20 right\n",
                              history.charts.size(), static_cast<double>(history.entries.size()) - 0.5) +
                  panels + "unset multiplot\n";
  return figure;
}

std::string history_section(const History& history) {
  HtmlTable table({HtmlTable::text("date"), HtmlTable::text("campaign"), "all k together, %",
                   "K<sub>T</sub>, N/(rad/s)²", "slope, N/(rad/s)² per degree"});
  for (std::size_t i = 0; i < history.entries.size(); ++i) {
    const HistoryEntry& entry = history.entries[i];
    const Estimate &stand = entry.of(Followed::stand), &K_T = entry.of(Followed::thrust_coefficient),
                   &slope = entry.of(Followed::slope);
    std::optional<std::size_t> bad;
    for (std::size_t j = history.charts.size(); j-- > 0;)
      if (is_named(history.charts[j], i)) bad = 2 + j;
    table.row({html_escaped(entry.when.substr(0, 10)), html_escaped(entry.name),
               html_number(100 * (stand.value - 1), "{:+.3f}") + " ± " + html_number(100 * expanded(stand), "{:.3f}"),
               with_power_of_ten(K_T.value, expanded(K_T)), with_power_of_ten(slope.value, expanded(slope))},
              bad);
  }
  return html_section("The campaigns over time", table,
                      history.air == Air::standard
                          ? "In standard air; ± is 95 % of what is new in each campaign."
                          : "In the air of their days, since some densities are unknown; ± is 95 % of what is new in "
                            "each campaign.");
}

std::string history_verdict(const History& history) {
  std::string said;
  for (const std::string& line : findings_of(history)) said += "<li>" + typeset(line) + "</li>\n";
  return fmt::format("<div class=\"remarks\"><h3>{}</h3>\n<ul>\n{}</ul></div>\n",
                     history.steady() ? "The stand is steady" : "The stand has changed", said);
}

}  // namespace kphi::fit
