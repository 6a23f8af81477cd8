#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <future>
#include <map>
#include <set>
#include <vector>

#include "base/ordered_work.hpp"
#include "base/text.hpp"
#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "commands/outputs.hpp"
#include "fit/logs/import_table.hpp"
#include "results/digest.hpp"
#include "results/file_layer.hpp"
#include "results/steps_csv.hpp"
#include "results/version.hpp"

namespace kphi::commands {
namespace {

using namespace fit;

namespace fs = std::filesystem;

struct ImportRequest {
  std::vector<std::string> files;
  std::string out;
  std::string speed;
  std::string speed_factor;
  std::vector<std::string> columns;
  std::string separator, decimal, layout;
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
  if (!request.speed.empty())
    options.rows.speed = request.speed == "optical" ? SpeedSource::optical : SpeedSource::electrical;
  if (!request.speed_factor.empty()) options.rows.speed_factor = parse_factor(request.speed_factor);
  for (const std::string& column : request.columns) options.hints.columns.push_back(parse_column_role(column));
  const std::map<std::string, char> separators{{"", '\0'},    {"comma", ','}, {"semicolon", ';'},
                                               {"tab", '\t'}, {"bar", '|'},   {"blanks", ' '}};
  options.hints.separator = separators.at(request.separator);
  if (!request.decimal.empty()) options.hints.decimal = request.decimal == "comma" ? ',' : '.';
  if (!fs::exists(request.layout)) return options;
  if (!request.columns.empty() || !request.separator.empty() || !request.decimal.empty())
    throw ConfigurationError(request.layout +
                             ": a layout says columns, separator and decimal mark; edit it, or leave it out");
  options.layout = parse_layout(results::read_text(request.layout), request.layout);
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

void print_findings(const Import& import, const JudgedFit& judged, const std::string& path) {
  for (const std::string& column : import.table.unread)
    fmt::print(stderr, "{}: column skipped: {}\n", path, printable(column));
  for (const auto* list : {&import.findings, &judged.findings}) {
    for (const LogFinding& finding : *list) {
      const std::string place = finding.first_line == 0 ? path : fmt::format("{}:{}", path, finding.first_line);
      fmt::print(stderr, "{}: {} ({} row{}): {}\n", place, name_of(finding.kind), finding.rows,
                 finding.rows == 1 ? "" : "s", printable(finding.text));
    }
  }
}

/// How the tables are written, for a person to confirm: once for all that are written alike.
class LayoutTalk {
 public:
  void say(const Import& import, const std::string& path, const std::string& file) {
    if (!import.layout) return;
    const std::string words = describe(*import.layout);
    if (said_.insert(words).second) fmt::print(stderr, "layout of {}:\n{}", path, printable(words, LineEnds::keep));
    if (file.empty() || fs::exists(file)) return;
    write_output(file, layout_text(*import.layout));
    fmt::print(stderr, "layout        written to {}: confirm it, then import all tables of this kind by it\n", file);
  }

 private:
  std::set<std::string> said_;
};

struct ImportedLog {
  NamedCoefficient coefficient;
  bool means_nothing = false;
  std::string folder;
};

/// "own-5x3_reverse": a folder's name
std::string folder_name(const std::string& stem, const std::string& group) {
  std::string name = group.empty() ? stem : stem + "-" + group;
  for (std::size_t i = stem.size(); i < name.size(); ++i) {
    const auto byte = static_cast<unsigned char>(name[i]);
    if (std::isalnum(byte) == 0 && name[i] != '-' && name[i] != '.' && byte < 0x80u) name[i] = '_';
  }
  return name;
}

/// Writes the table and says its k.
ImportedLog write_import(const std::string& path, const Import& import, const std::string& sha256,
                         const ImportRequest& request, const ImportOptions& options) {
  const ImportedTable& table = import.table;
  const std::string name = folder_name(fs::path(path).stem().string(), import.group);
  const fs::path folder = fs::path(request.out) / name;
  if (fs::exists(folder / "journal.jsonl") || fs::exists(folder / "runs"))
    throw ConfigurationError(folder.string() + ": holds a campaign; choose another --out");
  fs::create_directories(folder);
  std::future<JudgedFit> fitting =
      std::async(launch_for(table.size() * sizeof(Point)), [&table] { return judged_fit(table); });
  results::write_steps(folder / "steps.csv", {table.size(), [&](std::size_t row) { return table.step(row); }});
  const JudgedFit judged = fitting.get();
  const std::string record = import_record(import, judged, sha256, path, options, kVersion);
  write_output(folder / "import.json", record);
  print_findings(import, judged, path);
  fmt::print("{}", request.json ? record : fmt::format("{}: {}\n", name, summary_of(table, judged.fits)));
  if (!request.json)
    for (const std::string& line : throttle_lines(judged.throttle)) fmt::print("  {}\n", line);
  return {{name, judged.fits.front().fit.parameters.k}, spoilt(import, judged), folder.string()};
}

std::vector<ImportedLog> import_file(const std::string& path, const ImportRequest& request,
                                     const ImportOptions& options, LayoutTalk& talk) {
  results::HashedText text(path, results::kLargestLog);
  const std::vector<Import> imports = import_groups(text.blocks(), path, options);
  const std::string sha256 = text.sha256();
  talk.say(imports.front(), path, request.layout);
  std::vector<ImportedLog> logs;
  for (const Import& import : imports) logs.push_back(write_import(path, import, sha256, request, options));
  return logs;
}

void print_outliers(const std::vector<NamedCoefficient>& group) {
  for (const GroupOutlier& outlier : group_outliers(group)) {
    fmt::print(stderr,
               "{}: {}: k is {:+.1f} % from the median of the {} files of this propeller, which scatter by {:.1f} %; "
               "check its mounting and calibration before you use it\n",
               outlier.name, name_of(FindingKind::k_unlike_its_group), 100 * outlier.share, group.size(),
               100 * outlier.robust_sd);
  }
}

/// The command that makes something of what was read.
void print_next(const std::vector<std::string>& folders, const std::string& out) {
  constexpr std::size_t kNamed = 4;
  if (folders.empty()) return;
  const std::string all =
      folders.size() > kNamed ? (fs::path(out) / "*").string() + "/" : fmt::format("'{}'", fmt::join(folders, "' '"));
  if (folders.size() == 1)
    fmt::print(stderr, "next: kphi fit {}\n", all);
  else
    fmt::print(stderr, "next: kphi report {} --out {}\n", all, (fs::path(out) / "report.html").string());
}

ExitCode run_import(const ImportRequest& request) {
  const ImportOptions options = options_of(request);
  refuse_same_names(request.files);
  std::vector<NamedCoefficient> group;
  LayoutTalk talk;
  std::vector<std::string> folders;
  std::size_t read = 0;
  int spoilt = 0;
  for (const std::string& path : request.files) {
    try {
      refuse_other_input(path, InputKind::table);
      for (const ImportedLog& log : import_file(path, request, options, talk)) {
        group.push_back(log.coefficient);
        spoilt += log.means_nothing ? 1 : 0;
        if (!log.means_nothing) folders.push_back(log.folder);
      }
      ++read;
    } catch (const FitError& error) {
      fmt::print(stderr, "kphi: {}\n", printable(error.what()));
    } catch (const ConfigurationError& error) {
      if (request.files.size() == 1) throw;
      fmt::print(stderr, "kphi: {}\n", printable(error.what()));
    }
  }
  if (request.same_propeller) print_outliers(group);
  print_next(folders, request.out);
  return read == request.files.size() && spoilt == 0 ? ExitCode::ok : ExitCode::data_rejected;
}

}  // namespace

void add_import(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<ImportRequest>(
      program, exit_code, "import", "turn tables of any stand, and UIUC static tables, into step tables",
      "kphi import logs/*.csv --out tables\n"
      "kphi import own/*.csv --out tables --layout own.yaml\n"
      "kphi import own.csv --out tables --column 'thrust=Load [g]' --column speed=n:rpm --column occlusion=phi_deg",
      run_import);
  RowSelection& rows = request.options.rows;
  add_argument(command, "FILE", request.files, "tables; units come from their headers")->check(kExistingFile);
  add_value(command, "--out", "DIR", request.out, "output folder; every table becomes <name>/steps.csv in it")
      ->required();
  command.add_flag("--tared", rows.tared, "the stand was tared: take the zero of the thrust as it is");
  add_value(command, "--tare-rows", "N", rows.tare_rows, "tare on the first N rows, with the motor off (default 0)");
  command.add_flag("--reverse-thrust", rows.reverse_thrust, "reverse the sign of the thrust");
  command.add_flag("--same-propeller", request.same_propeller,
                   "all FILEs are of one propeller: name those whose k differs from the others");
  command.add_flag("--json", request.json, "print one JSON record per table");
  begin_group(command, "How the tables are written");
  add_value(command, "--column", "ROLE=HEADER[:UNIT]", request.columns,
            "meaning of one column whose name does not tell it, repeat for each; roles: " + role_list());
  add_value(
      command, "--layout", "FILE", request.layout,
      "how the tables are written: read from FILE if it exists, else found in the first table and written to FILE");
  command
      .add_option("--separator", request.separator,
                  "what is between two fields (default: what makes a table of the lines)")
      ->check(CLI::IsMember({"comma", "semicolon", "tab", "bar", "blanks"}));
  command.add_option("--decimal", request.decimal, "mark before decimals; the other one is between thousands")
      ->check(CLI::IsMember({"point", "comma"}));
  begin_group(command, "What the tables do not tell");
  add_value(command, "--propeller", "ID", request.options.propeller, "id of the propeller (default: the file's name)");
  command
      .add_option("--diameter-in", request.options.diameter_in,
                  "diameter in inches (UIUC default: from the file's name)")
      ->check(CLI::PositiveNumber);
  command.add_option("--blades", request.options.blades, "number of blades");
  command
      .add_option(
          "--air-density-kg-m3", request.options.air_density_kg_m3,
          "air density of the log, taken as exact; of a UIUC table, for which thrust is computed (default 1.225)")
      ->check(CLI::PositiveNumber);
  begin_group(command, "Which rows and speeds");
  command.add_option("--speed", request.speed, "which speed to take (default: electrical where it turns)")
      ->check(CLI::IsMember({"electrical", "optical"}));
  add_value(command, "--speed-factor", "NUMBER", request.speed_factor,
            "multiply the speed by a number or P/Q = assumed / true pole count, such as 7/6");
  command.add_option("--speed-above-rpm", rows.speed_above_rpm, "leave out rows at or below this speed (default 0)");
  command.add_option("--throttle-above-us", rows.throttle_above_us, "leave out rows at or below this throttle");
}

}  // namespace kphi::commands
