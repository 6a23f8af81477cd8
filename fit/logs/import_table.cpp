#include "fit/logs/import_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <utility>

#include "base/error.hpp"
#include "base/json.hpp"
#include "base/number.hpp"
#include "base/text.hpp"
#include "compensation/units.hpp"
#include "fit/logs/row_groups.hpp"
#include "fit/model/identification.hpp"
#include "fit/model/thrust_fit.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMetresPerInch = 0.0254;
constexpr double kDiameterMaxIn = 60;

bool part_of_number(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.'; }

double non_negative(const Table& table, const TableRow& row, std::size_t column) {
  const auto value = parse_number(row.fields[column]);
  if (value && *value >= 0) return *value;
  throw ConfigurationError(fmt::format("{}:{}: {} is {}; expected a number, 0 or above", table.path, row.line,
                                       table.header[column], in_quotes(row.fields[column])));
}

std::string_view first_line(std::string_view text) { return text.substr(0, text.find('\n')); }

constexpr const char *kPerRad2 = "k_n_s2_per_rad2", *kPerRpm2 = "k_n_per_rpm2";

/// The column's name, and N/(rad/s)² per unit of it.
std::pair<std::string, double> column_of_k(const Table& table, std::string_view unit) {
  const double per_rpm2 = from_newtons_per_rpm2(1).value();
  const auto refuse = [&](const char* words) {
    throw ConfigurationError(fmt::format("{}:{}: {}", table.path, table.header_line, words));
  };
  const bool in_rad = table.find_column(kPerRad2).has_value(), in_rpm = table.find_column(kPerRpm2).has_value(),
             bare = table.find_column("k").has_value();
  if (in_rad + in_rpm + bare > 1) refuse("several columns of k; keep one");
  if (!bare && !unit.empty()) refuse("the header names the unit of k already; leave --k-unit out");
  if (in_rad) return {kPerRad2, 1};
  if (in_rpm) return {kPerRpm2, per_rpm2};
  if (bare && unit.empty())
    refuse(
        "the unit of k is not known; call the column k_n_s2_per_rad2 for N/(rad/s)^2 or k_n_per_rpm2 for N/RPM^2, "
        "or give --k-unit");
  return {"k", unit == "N/RPM^2" ? per_rpm2 : 1};
}

/// Whether the header's columns are RPM and CT.
bool is_uiuc(std::string_view text) {
  const Table header = read_blank_separated(first_line(text), "");
  return header.find_column("RPM") && header.find_column("CT");
}

Import import_log(RowGroup group, RowSelection selection) {
  Import import;
  StandLog& log = group.log;
  import.findings = audit(log, selection);
  import.layout = log.layout;
  import.group = group.name;
  for (const LogFinding& finding : import.findings) {
    if (finding.kind == FindingKind::speed_ratio && !selection.speed)
      throw FitError(fmt::format("{}: {}", log.path, finding.text));
  }
  const LogRest rest = rest_of(log, choose_speed(log, selection));
  import.table = select_rows(std::move(log), selection);
  flag_steps(import.table, import.findings);
  if (std::ranges::any_of(import.findings, spoils_k, &LogFinding::kind)) return import;
  const std::vector<bool> left_out = import.table.left_out;
  leave_out_obvious(import.table);
  const ZeroOfLog zero = zero_of(rest, import.table, selection);
  for (LogFinding& finding : findings_of(zero, import.table)) import.findings.push_back(std::move(finding));
  import.table.left_out = left_out;  // what else goes shows now that the zero is known
  import.table.zero_u_n = zero.u_n;
  import.table.tare_n = zero.zero_n;
  for (LogFinding& finding : audit_rows(import.table)) import.findings.push_back(std::move(finding));
  return import;
}

/// What is turned is audited after turning.
std::vector<Import> import_logs(StandLog log, RowSelection selection) {
  if (std::exchange(selection.reverse_thrust, false)) turn_thrust(log);
  RowGroups groups = split_groups(std::move(log), selection);
  std::vector<Import> imports;
  for (RowGroup& group : groups.groups) imports.push_back(import_log(std::move(group), selection));
  imports.front().findings.insert(imports.front().findings.begin(), groups.findings.begin(), groups.findings.end());
  return imports;
}

Import import_uiuc(TextBlocks text, const std::string& path, const ImportOptions& options) {
  Import import{
      read_uiuc(std::move(text), path, options.diameter_in, options.air_density_kg_m3.value_or(kUiucDensityKgM3)),
      {},
      {}};
  for (const TableProblem& problem : import.table.problems)
    import.findings.push_back({FindingKind::other_fields, 1, problem.line, problem.what, { problem.line }});
  return import;
}

}  // namespace

std::optional<double> diameter_from_name(std::string_view file_name) {
  for (std::size_t x = file_name.find('x', 1); x != std::string_view::npos; x = file_name.find('x', x + 1)) {
    if (x + 1 >= file_name.size() || !part_of_number(file_name[x + 1])) continue;
    std::size_t begin = x;
    while (begin > 0 && part_of_number(file_name[begin - 1])) --begin;
    const auto diameter = parse_number(file_name.substr(begin, x - begin));
    if (diameter && *diameter > 0 && *diameter <= kDiameterMaxIn) return diameter;
  }
  return std::nullopt;
}

ImportedTable read_uiuc(TextBlocks text, std::string path, std::optional<double> diameter_in, double density_kg_m3) {
  const Table table = read_blank_separated(std::move(text), std::move(path));
  const std::size_t rpm_column = table.column("RPM"), ct_column = table.column("CT");
  const std::filesystem::path file(table.path);
  if (!diameter_in) diameter_in = diameter_from_name(file.filename().string());
  if (!diameter_in)
    throw ConfigurationError(fmt::format("{}:1: no diameter in the file's name; give --diameter-in", table.path));
  ImportedTable imported;
  imported.unit = fmt::format("CT, rho {} kg/m3, D {} in", density_kg_m3, *diameter_in);
  imported.speed_source = "table";
  imported.propeller = file.stem().string();
  imported.diameter_in = *diameter_in;
  imported.rows_total = table.rows.size() + table.problems.size();
  imported.problems = table.problems;
  for (const TableRow& row : table.rows) {
    const auto rpm = parse_number(row.fields[rpm_column]), ct = parse_number(row.fields[ct_column]);
    if (!rpm || !ct || !(*rpm > 0)) {
      imported.problems.push_back({row.line, "RPM or CT is not a number above 0; line skipped"});
      continue;
    }
    const double turns_per_s = *rpm / 60, diameter = *diameter_in * kMetresPerInch;
    imported.rows.push_back({.line = static_cast<std::uint32_t>(row.line),
                             .optical_rpm = *rpm,
                             .thrust_n = *ct * density_kg_m3 * turns_per_s * turns_per_s * std::pow(diameter, 4)});
  }
  if (imported.rows.empty()) throw ConfigurationError(fmt::format("{}:1: no row with a speed above 0", table.path));
  imported.quality_flags.resize(imported.size());
  refuse_reversed_thrust(imported, table.path);
  return imported;
}

bool is_k_table(std::string_view text) {
  const Table header = read_csv(first_line(text), "");
  return header.find_column("phi_deg") &&
         (header.find_column("k") || header.find_column(kPerRad2) || header.find_column(kPerRpm2));
}

std::vector<CurvePoint> read_k_table(std::string_view text, std::string path, std::string_view unit_of_k) {
  const Table table = read_csv(text, std::move(path));
  if (!table.problems.empty()) {
    const auto& [line, what] = table.problems.front();
    throw ConfigurationError(fmt::format("{}:{}: {}", table.path, line, what.substr(0, what.find(';'))));
  }
  const auto [name, unit] = column_of_k(table, unit_of_k);
  const std::size_t phi = table.column("phi_deg"), k = table.column(name);
  const auto error = table.find_column("u_" + name);
  std::vector<CurvePoint> points;
  for (const TableRow& row : table.rows) {
    points.push_back({non_negative(table, row, phi), non_negative(table, row, k) * unit,
                      error && !row.fields[*error].empty() ? non_negative(table, row, *error) * unit : 0});
  }
  return points;
}

std::vector<Import> import_groups(TextBlocks text, const std::string& path, const ImportOptions& options) {
  std::vector<Import> imports;
  if (options.layout) {
    imports = import_logs(read_log(std::move(text), path, *options.layout), options.rows);
  } else if (is_uiuc(text.front())) {
    imports.push_back(import_uiuc(std::move(text), path, options));
  } else {
    imports = import_logs(read_log(std::move(text), path, options.hints), options.rows);
  }
  for (Import& import : imports) {
    if (!options.propeller.empty()) import.table.propeller = options.propeller;
    if (!import.group.empty()) import.table.propeller += ", " + import.group;
    if (options.diameter_in) import.table.diameter_in = *options.diameter_in;
    import.table.blades = options.blades;
    import.table.air_density_kg_m3 = options.air_density_kg_m3.value_or(results::kNotMeasured);
  }
  return imports;
}

Import import_table(TextBlocks text, const std::string& path, const ImportOptions& options) {
  std::vector<Import> imports = import_groups(std::move(text), path, options);
  if (imports.size() == 1) return std::move(imports.front());
  throw FitError(fmt::format("{}: {}", path, imports.front().findings.front().text));
}

std::string summary_of(const ImportedTable& imported, const std::vector<OcclusionFit>& fits) {
  std::string text = fmt::format("{} of {} rows, thrust in {}, {} speed", imported.size(), imported.rows_total,
                                 imported.unit, imported.speed_source);
  if (imported.tare_n != 0) text += fmt::format(", tare {:.4f} N", imported.tare_n);
  for (const OcclusionFit& one : fits) {
    text += fmt::format(", k{} = {} N/(rad/s)^2, rms {:.4f} N",
                        fits.size() == 1 ? "" : fmt::format("({:g}°)", one.occlusion_deg),
                        with_error(one.fit.parameters.k, one.u_k), one.fit.rms_n);
  }
  return text;
}

bool spoilt(const Import& import, const JudgedFit& judged) {
  return std::ranges::any_of(import.findings, spoils_k, &LogFinding::kind) ||
         std::ranges::any_of(judged.findings, spoils_k, &LogFinding::kind);
}

std::string import_record(const Import& import, const JudgedFit& judged, const std::string& sha256,
                          const std::string& path, const ImportOptions& options, const std::string& tool_version) {
  Json findings = Json::array();
  for (const auto* list : {&import.findings, &judged.findings}) {
    for (const LogFinding& finding : *list) {
      Json& one = findings.emplace_back(Json{{"kind", name_of(finding.kind)}});
      KPHI_JSON_MEMBERS(one, finding, rows, first_line, text, lines);
    }
  }
  const ThrustFit& fit = judged.fits.front().fit;
  const bool pooled = judged.fits.size() == 1;
  const auto of_one = [&](double value) { return pooled ? Json(value) : Json(); };
  Json problems = Json::array();
  for (const TableProblem& problem : import.table.problems)
    problems.push_back({{"line", problem.line}, {"what", problem.what}});
  Json throttle = Json::array();
  for (const ThrottleLaw& law : judged.throttle) {
    Json& one = throttle.emplace_back(Json{{"law", name_of(law.form)}, {"rows", law.n}});
    KPHI_JSON_MEMBERS(one, law, rms_n);
    one["numbers"] = one["not_told_from"] = Json::array();
    for (const ThrottleParameter& number : law.parameters)
      KPHI_JSON_MEMBERS(one["numbers"].emplace_back(), number, name, value, half_95);
    for (const ThrottleForm other : law.not_told_from) one["not_told_from"].push_back(name_of(other));
  }
  Json record{{"format", "kphi-import/1"},
              {"source", path},
              {"sha256", sha256},
              {"tool_version", tool_version},
              {"thrust_unit", import.table.unit},
              {"rows_used", import.table.size()},
              {"k_n_s2_per_rad2", of_one(fit.parameters.k)},
              {"k_standard_error_n_s2_per_rad2", of_one(fit.standard_error.k)},
              {"k_u_n_s2_per_rad2", of_one(judged.fits.front().u_k)},
              {"rms_n", of_one(fit.rms_n)},
              {"u_speed_share", judged.u_speed},
              {"propeller", import.table.propeller},
              {"k_means_nothing", spoilt(import, judged)},
              {"throttle_laws", throttle},
              {"columns_left_out", import.table.unread},
              {"findings", findings},
              {"lines_left_out", problems}};
  KPHI_JSON_MEMBERS(record, import.table, speed_source, tare_n, rows_total);
  KPHI_JSON_MEMBERS(record, import.table, reverse_thrust);
  KPHI_JSON_MEMBERS(record, options.rows, speed_factor);
  if (!import.group.empty()) record["group"] = import.group;
  return record.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace kphi::fit
