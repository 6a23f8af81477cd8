#include "fit/logs/import_table.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "fit/logs/coefficient_table.hpp"
#include "fit/report/fit_summary.hpp"
#include "results/file_layer.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

Import import_log(const StandLog& log, const RowSelection& selection) {
  Import import;
  import.findings = audit(log, selection);
  for (const LogFinding& finding : import.findings) {
    if (finding.kind == FindingKind::speed_ratio && !selection.speed)
      throw FitError(fmt::format("{}: {}", log.path, finding.text));
  }
  import.table = select_rows(log, selection);
  flag_steps(import.table, import.findings);
  return import;
}

Import import_uiuc(std::string_view text, const std::string& path, const ImportOptions& options) {
  UiucOptions uiuc{.diameter_in = options.diameter_in};
  if (options.air_density_kg_m3) uiuc.density_kg_m3 = *options.air_density_kg_m3;
  Import import{read_uiuc(text, path, uiuc), {}};
  for (const TableProblem& problem : import.table.problems)
    import.findings.push_back({FindingKind::other_fields, 1, problem.line, problem.what, { problem.line }});
  return import;
}

}  // namespace

Import import_table(std::string_view text, const std::string& path, const ImportOptions& options) {
  Import import = !options.columns.empty()
                      ? import_log(read_columns(text, path, options.columns, options.dialect), options.rows)
                  : is_uiuc(text) ? import_uiuc(text, path, options)
                                  : import_log(read_rcbenchmark(text, path), options.rows);
  for (results::StepMean& step : import.table.steps) {
    if (!options.propeller.empty()) step.propeller = options.propeller;
    if (options.diameter_in) step.diameter_in = *options.diameter_in;
    step.blades = options.blades;
  }
  return import;
}

std::string summary_of(const ImportedTable& imported) {
  const ThrustFit fit = fit_thrust(points_of(imported.steps));
  std::string text = fmt::format("{} of {} rows, thrust in {}, {} speed", imported.steps.size(), imported.rows_total,
                                 imported.unit, imported.speed_source);
  if (imported.tare_n != 0) text += fmt::format(", tare {:.4f} N", imported.tare_n);
  return text + fmt::format(", k = {} N/(rad/s)^2, rms {:.4f} N", with_error(fit.parameters.k, fit.standard_error.k),
                            fit.rms_n);
}

std::string import_record(const Import& import, std::string_view text, const std::string& path,
                          const ImportOptions& options, const std::string& tool_version) {
  Json findings = Json::array();
  for (const LogFinding& finding : import.findings) {
    findings.push_back({{"kind", name_of(finding.kind)},
                        {"rows", finding.rows},
                        {"first_line", finding.first_line},
                        {"text", finding.text},
                        {"lines", finding.lines}});
  }
  Json problems = Json::array();
  for (const TableProblem& problem : import.table.problems)
    problems.push_back({{"line", problem.line}, {"what", problem.what}});
  const Json record{{"format", "kphi-import/1"},
                    {"source", path},
                    {"sha256", results::sha256(text)},
                    {"tool_version", tool_version},
                    {"thrust_unit", import.table.unit},
                    {"speed_source", import.table.speed_source},
                    {"speed_factor", options.rows.speed_factor},
                    {"reverse_thrust", options.rows.reverse_thrust},
                    {"tare_n", import.table.tare_n},
                    {"rows_total", import.table.rows_total},
                    {"rows_used", import.table.steps.size()},
                    {"columns_left_out", import.table.unread},
                    {"findings", findings},
                    {"lines_left_out", problems}};
  return record.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace kphi::fit
