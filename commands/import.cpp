#include "commands/import.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "fit/logs/import_table.hpp"
#include "results/file_layer.hpp"
#include "results/steps_csv.hpp"
#include "results/version.hpp"

namespace kphi::fit {
namespace {

namespace fs = std::filesystem;

struct ImportRequest {
  std::vector<std::string> files;
  std::string out;
  std::string speed;
  std::string speed_factor;
  std::vector<std::string> columns;
  std::string separator;
  std::optional<double> diameter_in, density;
  bool same_propeller = false;
  bool json = false;
  ImportOptions options;
};

/// "7/6" or "1.1667".
double parse_factor(const std::string& text) {
  const std::size_t bar = text.find('/');
  const auto above = parse_number(text.substr(0, bar));
  const auto below = bar == std::string::npos ? std::optional(1.0) : parse_number(text.substr(bar + 1));
  if (!above || !below || !(*above > 0) || !(*below > 0))
    throw ConfigurationError("--speed-factor " + text + ": expected a positive number or P/Q, such as 7/6");
  return *above / *below;
}

ImportOptions options_of(const ImportRequest& request) {
  ImportOptions options = request.options;
  options.diameter_in = request.diameter_in;
  options.air_density_kg_m3 = request.density;
  if (!request.speed.empty())
    options.rows.speed = request.speed == "optical" ? SpeedSource::optical : SpeedSource::electrical;
  if (!request.speed_factor.empty()) options.rows.speed_factor = parse_factor(request.speed_factor);
  for (const std::string& column : request.columns) options.columns.push_back(parse_column_role(column));
  const std::map<std::string, char> separators{{"", '\0'}, {"comma", ','}, {"semicolon", ';'}, {"tab", '\t'}};
  options.dialect.separator = separators.at(request.separator);
  return options;
}

/// Two files of the same name in different folders would overwrite each other.
void refuse_same_names(const std::vector<std::string>& files) {
  std::map<std::string, std::string> names;
  for (const std::string& file : files) {
    const auto [there, fresh] = names.emplace(fs::path(file).stem().string(), file);
    if (!fresh)
      throw ConfigurationError(there->second + " and " + file + " would both become " + there->first +
                               "; import them apart");
  }
}

void tell(const Import& import, const std::string& path) {
  for (const std::string& column : import.table.unread) fmt::print(stderr, "{}: column left out: {}\n", path, column);
  for (const Finding& finding : import.findings) {
    const std::string place = finding.first_line == 0 ? path : fmt::format("{}:{}", path, finding.first_line);
    fmt::print(stderr, "{}: {} ({} row{}): {}\n", place, name_of(finding.kind), finding.rows,
               finding.rows == 1 ? "" : "s", finding.text);
  }
}

/// Writes the table and says its k, which is returned.
double import_file(const std::string& path, const ImportRequest& request, const ImportOptions& options) {
  const std::string text = results::read_text(path);
  const Import import = import_table(text, path, options);
  const std::string name = fs::path(path).stem().string();
  const fs::path folder = fs::path(request.out) / name;
  fs::create_directories(folder);
  results::MemoryOnlySync files;  // made again from the source at any time
  results::write_steps(folder / "steps.csv", import.table.steps, files);
  const std::string record = import_record(import, text, path, options, kVersion);
  results::write_text(folder / "import.json", record, files);
  tell(import, path);
  if (request.json) fmt::print("{}", record);
  const std::string summary = summary_of(import.table);
  if (!request.json) fmt::print("{}: {}\n", name, summary);
  return fit_thrust(points_of(import.table.steps)).parameters.k;
}

void tell_outliers(const std::vector<NamedCoefficient>& group) {
  for (const GroupOutlier& outlier : group_outliers(group)) {
    fmt::print(stderr,
               "{}: {}: k is {:+.1f} % from the median of the {} files of this propeller, which scatter by {:.1f} %; "
               "look at its mounting and calibration before it is used\n",
               outlier.name, name_of(FindingKind::k_unlike_its_group), 100 * outlier.share, group.size(),
               100 * outlier.robust_sd);
  }
}

void run_import(const ImportRequest& request, int& exit_code) {
  const ImportOptions options = options_of(request);
  refuse_same_names(request.files);
  std::vector<NamedCoefficient> group;
  for (const std::string& path : request.files) {
    try {
      group.push_back({fs::path(path).stem().string(), import_file(path, request, options)});
    } catch (const FitError& error) {
      fmt::print(stderr, "kphi: {}\n", error.what());
      exit_code = static_cast<int>(ExitCode::data_rejected);
    } catch (const ConfigurationError& error) {
      if (request.files.size() == 1) throw;
      fmt::print(stderr, "kphi: {}\n", error.what());
      exit_code = static_cast<int>(ExitCode::data_rejected);
    }
  }
  if (request.same_propeller) tell_outliers(group);
}

}  // namespace

void add_import(CLI::App& app, int& exit_code) {
  auto request = std::make_shared<ImportRequest>();
  RowSelection& rows = request->options.rows;
  CLI::App* command = app.add_subcommand("import", "RCbenchmark CSV, UIUC static tables, any CSV → step tables");
  command->add_option("FILE", request->files, "tables; units are taken from their headers")
      ->required()
      ->check(CLI::ExistingFile);
  command->add_option("--out", request->out, "folder; every table becomes <name>/steps.csv in it")->required();
  command->add_option("--column", request->columns,
                      "ROLE=HEADER[:UNIT], once per column of a table of any make; roles: thrust, speed, "
                      "electrical_speed, torque, time, throttle, voltage, current, occlusion, repetition");
  command->add_option("--separator", request->separator, "of such a table (default: what its header line has most of)")
      ->check(CLI::IsMember({"comma", "semicolon", "tab"}));
  command->add_flag("--decimal-comma", request->options.dialect.decimal_comma, "numbers in it are written 1,5");
  command->add_option("--speed", request->speed, "which speed to take (default: electrical where it turns)")
      ->check(CLI::IsMember({"electrical", "optical"}));
  command->add_option("--speed-factor", request->speed_factor,
                      "on the speed, a number or P/Q; assumed over true pole count mends it");
  command->add_option("--speed-above-rpm", rows.speed_above_rpm, "rows at or below are left out (default 0)");
  command->add_option("--throttle-above-us", rows.throttle_above_us, "rows at or below are left out");
  command->add_option("--tare-rows", rows.tare_rows, "tare with so many first rows of a still motor (default 0)");
  command->add_flag("--reverse-thrust", rows.reverse_thrust, "the stand measured thrust with the other sign");
  command->add_option("--diameter-in", request->diameter_in, "diameter in inches (UIUC default: from the file's name)")
      ->check(CLI::PositiveNumber);
  command->add_option("--air-density-kg-m3", request->density, "with which UIUC coefficients become thrust (1.225)")
      ->check(CLI::PositiveNumber);
  command->add_option("--propeller", request->options.propeller, "id of the propeller (default: the file's name)");
  command->add_option("--blades", request->options.blades, "number of blades");
  command->add_flag("--same-propeller", request->same_propeller,
                    "all FILEs are of one propeller: name those whose k is unlike the others'");
  command->add_flag("--json", request->json, "one JSON record per table on stdout");
  command->footer(
      "kphi import logs/*.csv --out tables\n"
      "kphi import own.csv --out tables --column 'thrust=Load [g]' --column speed=n:rpm --column occlusion=phi_deg");
  command->callback([request, &exit_code] { run_import(*request, exit_code); });
}

}  // namespace kphi::fit
