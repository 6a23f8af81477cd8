#include "fit/report/campaign_sections.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/number.hpp"
#include "compensation/units.hpp"
#include "fit/model/torque_power.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/report/html.hpp"
#include "fit/report/raw_samples.hpp"

namespace kphi::fit {
namespace {

using Cells = std::vector<std::string>;

std::string whole(std::size_t n) { return fmt::format("{}", n); }

Cells run_row(const RunProvenance& run, const StepSelection& selection) {
  std::size_t used = 0, left_out = 0;
  std::string flags;  // each once, in the order of their first step
  for (const results::StepMean& step : selection.used) used += is_run_of(run, step) ? 1 : 0;
  for (const FlaggedStep& flagged : selection.flagged) {
    if (!is_run_of(run, flagged.step)) continue;
    left_out += flagged.left_out ? 1 : 0;
    if (flags.find(flagged.reason) == std::string::npos) flags += (flags.empty() ? "" : "; ") + flagged.reason;
  }
  flags = html_escaped(flags);
  for (const std::string& event : run.events) flags += (flags.empty() ? "" : "<br/>") + html_escaped(event);
  Cells cells{html_escaped(run.file), run.outcome.empty() ? "–" : html_escaped(run.outcome), whole(used),
              whole(left_out)};
  if (const auto& account = run.account) {
    cells.insert(cells.end(), {whole(account->expected), whole(account->received),
                               whole(account->lost_network + account->lost_host)});
  } else {
    cells.insert(cells.end(), 3, "–");
  }
  cells.push_back(flags.empty() ? "none" : flags);
  return cells;
}

std::string sentence(const char* term, const std::string& description) {
  return fmt::format("<dt>{}</dt><dd>{}</dd>\n", term, typeset(description));
}

/// A name or a number, which stays as it is.
std::string entry(const char* term, const std::string& description) {
  return fmt::format("<dt>{}</dt><dd>{}</dd>\n", term, html_escaped(description));
}

std::string clock_words(const MotorClock& clock) {
  if (!clock.u_gain)
    return "unchecked: all speeds may be off together by a few tenths of a percent, and k by twice that; measure it "
           "with `kphi devices --bench FILE --clock-gain`";
  return fmt::format("gain {:.7g} ± {:.1e}, speeds are corrected; shared by all steps: {:.1e} of k", clock.gain,
                     *clock.u_gain, 2 * *clock.u_gain / clock.gain);
}

std::string hash_section(const std::vector<RunProvenance>& runs) {
  HtmlTable table({HtmlTable::text("file"), {"SHA-256", HtmlTable::Column::hash}}, true);
  for (const RunProvenance& run : runs) table.row({html_escaped(run.file), html_escaped(run.sha256)});
  return html_section("Hashes of the runs", table);
}

std::string power_section(const Identification& identification) {
  constexpr std::size_t kRows = 5;
  std::map<double, std::vector<StepPower>> by_angle;
  for (const StepPower& row : power_of(identification.selection.used)) by_angle[row.phi_deg].push_back(row);
  HtmlTable table({"φ", "step", "speed, RPM", "thrust, N", "power, W", "g/W", "N/W", HtmlTable::text("measured by")});
  for (const auto& [phi, rows] : by_angle) {
    const std::size_t n = std::min(kRows, rows.size());
    for (std::size_t i = 1; i <= n; ++i) {
      const StepPower& row = rows[i * rows.size() / n - 1];
      table.row({html_angle(phi), fmt::format("{}", row.step + 1), html_rpm(row.speed_rad_s),
                 fmt::format("{:.4f}", row.thrust_n), fmt::format("{:.2f}", row.power_w),
                 fmt::format("{:.3f}", row.gram_per_watt()), fmt::format("{:.5f}", row.newton_per_watt()),
                 row.by_supply ? "supply" : "module"});
    }
  }
  return html_section("Power", table);
}

std::string step_section(const StepSelection& selection) {
  const auto left_out = std::ranges::count(selection.flagged, true, &FlaggedStep::left_out);
  const std::string html =
      html_heading("Steps left out") +
      fmt::format("<p>{} steps were fitted; {} left out for a quality flag, {} outside the speed range.</p>\n",
                  selection.used.size(), left_out, selection.outside_range) +
      html_note(
          "A step is left out for a quality flag or by hand, both with a stated cause, never for being far from "
          "the others: the scatter of the repetitions is part of their uncertainty (JCGM 100, 3.4.7 and 4.2) and "
          "of the budget.");
  HtmlTable table({"φ", "repetition", "step", "commanded, RPM", "measured, RPM", "thrust, N", HtmlTable::text("flag"),
                   HtmlTable::text("verdict")},
                  true);
  for (const FlaggedStep& flagged : selection.flagged) {
    const results::StepMean& step = flagged.step;
    table.row({html_angle(step.occlusion_deg), fmt::format("{}", step.repetition), fmt::format("{}", step.step + 1),
               html_rpm(step.commanded_speed_rad_s), html_rpm(step.speed_rad_s), fmt::format("{:.4f}", step.thrust_n),
               html_escaped(flagged.reason), flagged.left_out ? "left out" : "kept"});
  }
  return html + table.html();
}

std::string run_section(const Provenance& provenance, const StepSelection& selection) {
  HtmlTable table({HtmlTable::text("file"), HtmlTable::text("outcome"), "steps fitted", "left out", "samples expected",
                   "received", "lost", HtmlTable::text("flags and events")},
                  true);
  const auto bad = [](bool is_bad) { return is_bad ? std::optional<std::size_t>(1) : std::nullopt; };
  for (const RunProvenance& run : provenance.runs)
    table.row(run_row(run, selection), bad(!run.outcome.empty() && run.outcome != "complete"));
  for (const RejectedRun& run : provenance.rejected) {
    table.row({html_escaped(run.file), "not accepted", "0", "–", "–", "–", "–",
               html_escaped(run.utc) + ": " + html_escaped(run.reason)},
              bad(true));
  }
  return html_section("Runs", table);
}

std::string provenance_section(const Identification& identification, const Provenance& provenance) {
  const auto known = [](const std::string& words) { return words.empty() ? "unknown" : words; };
  const CurveFit& curve = identification.curve_fit;
  const auto& air = identification.air;
  std::string points;
  for (const CurvePoint& point : curve.points) points += (points.empty() ? "" : ", ") + html_angle(point.phi_deg);
  std::string html = html_heading("Provenance") + "<dl>\n";
  html += entry("Campaign", known(provenance.campaign));
  html += entry("Fitted from", provenance.source);
  html += sentence("Model", "T = k ω²: " + estimator_words(identification));
  html += sentence("k(φ)", identification.alone() ? "none: no occlusion was measured"
                                                  : curve.model().words(curve) + ", points " + points);
  if (speeds_known(identification))
    html += entry("Speeds", html_rpm(identification.speed_min_rad_s) + " to " +
                                html_rpm(identification.speed_max_rad_s) + " RPM");
  html += entry("Overlap", std::string(compensation::name_of(identification.options.overlap)) +
                               ": measure φ in this way in flight; on the bench's sector plates all measures are the "
                               "same angle");
  html += entry("Air density", air ? fmt::format("{:.4f} ± {:.4f} kg/m³", air->value, air->u) : "unknown");
  const auto& supply = provenance.supply_v;
  html += entry("Supply", supply && std::isfinite(*supply) ? fmt::format("{:g} V", *supply) : "unknown");
  if (provenance.clock) html += sentence("Motor's clock", clock_words(*provenance.clock));
  html += entry("Origin", name_of(provenance.origin));
  html += entry("Date", known(provenance.measured_utc));
  html += entry("Fitted by", "kphi " + provenance.tool_version);
  if (!provenance.stand.empty()) html += entry("Bench", provenance.stand);
  if (!provenance.operator_name.empty()) html += entry("Operator", provenance.operator_name);
  return html + "</dl>\n";
}

/// Of an imported log.
std::string throttle_section(const Provenance& provenance) {
  if (provenance.throttle.empty()) return {};
  HtmlTable table(
      {HtmlTable::text("law"), HtmlTable::text("numbers, 95 %"), "residual rms, N", HtmlTable::text("not told from")},
      true);
  for (const auto& law : provenance.throttle) {
    std::string numbers;
    for (const auto& one : law.numbers)
      numbers += (numbers.empty() ? "" : ", ") + one.name + " " +
                 (one.half_95 > 0 ? plain_with_error(one.value, one.half_95) : fmt::format("{:.4g}", one.value));
    table.row({html_escaped(law.name), html_escaped(numbers), fmt::format("{:.3g}", law.rms_n),
               html_escaped(fmt::format("{}", fmt::join(law.not_told_from, ", ")))});
  }
  return html_section("Thrust over throttle", table,
                      "The law of each flight stack, as its source computes it; it holds for the supply and the speed "
                      "controller of this log. ± comes from the scatter of the rows alone. Exports write them.");
}

}  // namespace

std::string campaign_sections(const Identification& identification, const Provenance& provenance) {
  return throttle_section(provenance) + provenance_section(identification, provenance);
}

std::string campaign_appendix(const Identification& identification, const Provenance& provenance) {
  return power_section(identification) + step_section(identification.selection) +
         run_section(provenance, identification.selection) + hash_section(provenance.runs);
}

}  // namespace kphi::fit
