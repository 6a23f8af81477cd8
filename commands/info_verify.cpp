#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "base/text.hpp"
#include "commands/campaign_summary.hpp"
#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "results/campaign_folder.hpp"
#include "results/digest.hpp"
#include "results/run_layout.hpp"
#include "results/run_reader.hpp"

namespace kphi::commands {
namespace {

using namespace results;

struct VerifyRequest {
  std::string path;
  bool json = false;
};

/// The figures at the end of a run whose names begin with `prefix`, without it.
Json figures_of(const RunEnding& ending, std::string_view prefix) {
  Json figures;
  for_each_figure(ending, [&](std::string_view name, const auto& value) {
    if (name.starts_with(prefix)) figures[std::string(name.substr(prefix.size()))] = value;
  });
  return figures;
}

Json describe(const std::filesystem::path& path) {
  const RunRecording run = read_run(path);
  const RunHeader& header = run.header;
  const double seconds =
      run.phases.empty() ? 0 : 1e-9 * static_cast<double>(run.phases.back().time_ns - run.phases.front().time_ns);
  const auto steps = std::ranges::count_if(run.phases, [](const PhaseMark& m) { return m.phase == Phase::step; });
  Json events = Json::array();
  for (const StreamEvent& event : run.events)
    events.push_back({{"kind", name_of(event.kind)}, {"t_ns", event.time_ns}, {"text", event.text}});
  Json told{{"file", path.string()},
            {"origin", header.origin.empty() ? "unknown" : header.origin},
            {"outcome", run.outcome == Outcome::complete ? "complete" : "aborted"},
            {"outcome_reason", run.outcome_reason},
            {"campaign", header.campaign_name},
            {"propeller", header.propeller_name},
            {"duration_s", seconds},
            {"steps", steps},
            {"samples", run.load_cell.size()},
            {"events", events},
            {"health", figures_of(run, "health_")},
            {"box_bias", run.box_bias.records == 0 ? Json() : figures_of(run, "box_bias_")},
            {"motor_readings", run.motor.size()},
            {"calibration_serial", header.load_cell.serial},
            {"configuration_sha256", sha256(header.load_cell.configuration_xml)},
            {"sample_rate_hz", header.load_cell.sample_rate_hz},
            {"saturation_bits", fmt::format("{:#010x}", header.load_cell.saturation_bits)},
            {"motor", header.motor_identity},
            {"clock_gain", header.clock_gain_u > 0 ? Json{header.clock_gain, header.clock_gain_u} : Json()}};
  KPHI_JSON_MEMBERS(told, run.account, lost_network, lost_host, duplicates, late, reordered, stalled, malformed,
                    restarts, reboots);
  KPHI_JSON_MEMBERS(told, header.load_cell, counts_per_newton, counts_per_newton_metre);
  KPHI_JSON_MEMBERS(told, header, occlusion_deg, repetition, started_utc, supply_voltage_v, coil_temperature_max_degc,
                    tool_version, uuid);
  for (std::size_t i = 0; i < kMotorCounts.size(); ++i) told[kMotorCounts[i]] = run.motor_counts[i];
  return told;
}

Json describe_folder(const CampaignFolder& folder) {
  Json runs = Json::array();
  for (const auto& path : folder.complete_runs()) runs.push_back(describe(path));
  for (const auto& path : folder.reference_runs()) runs.push_back(describe(path));
  Json others = Json::array();
  for (const auto& path : folder.other_runs()) others.push_back(path.string());
  Json told = to_json(summary_of(folder));
  told["runs"] = runs;
  told["not_complete"] = others;
  return told;
}

void print_run(const Json& run) {
  const auto line = [](const std::string& name, const Json& value) {
    fmt::print("{:28} {}\n", name, value.is_string() ? printable(value.get<std::string>()) : value.dump());
  };
  for (const auto& [key, value] : run.items()) {
    if (value.is_null()) continue;
    if (key == "events") {
      for (const Json& event : value) line("event", event["text"]);
    } else if (value.is_object()) {
      for (const auto& [inner, figure] : value.items()) line(key + " " + inner, figure);
    } else {
      line(key, value);
    }
  }
}

void print_folder(const std::string& path, const Json& folder) {
  fmt::print("{}", to_text(summary_of(CampaignFolder::open(path))));
  for (const Json& run : folder["runs"]) {
    fmt::print("  {}: {} at {}°, repetition {}, {} steps, {} samples, {} lost\n",
               std::filesystem::path(run["file"].get<std::string>()).filename().string(),
               printable(run["propeller"].get<std::string>()), run["occlusion_deg"].dump(), run["repetition"].dump(),
               run["steps"].dump(), run["samples"].dump(),
               run["lost_network"].get<std::uint64_t>() + run["lost_host"].get<std::uint64_t>());
  }
  for (const Json& file : folder["not_complete"]) {
    fmt::print("  {}: not complete\n", std::filesystem::path(file.get<std::string>()).filename().string());
  }
}

ExitCode info(const VerifyRequest& asked) {
  refuse_other_input(asked.path, InputKind::run);
  const bool folder = std::filesystem::is_directory(asked.path);
  Json found;
  try {
    found = folder ? describe_folder(CampaignFolder::open(asked.path)) : describe(asked.path);
  } catch (const RecordError& error) {
    throw DataRejected(fmt::format("{}; kphi info takes a campaign folder or a file of its runs/", error.what()));
  }
  asked.json ? print_json(found) : folder ? print_folder(asked.path, found) : print_run(found);
  return ExitCode::ok;
}

/// Whether coefficients.yaml is as it was written, from the runs that the journal accepted.
std::vector<std::string> problems_of_coefficients(const CampaignFolder& folder) {
  std::vector<std::string> problems;
  const std::string path = folder.coefficients().string();
  if (!std::filesystem::exists(path) || !std::filesystem::exists(folder.journal())) return problems;
  try {
    problems = unlike_journal(load_sealed_coefficients(path), state_of(read_journal(folder.journal())));
  } catch (const std::runtime_error& error) {
    problems.emplace_back(error.what());
  }
  return problems;
}

ExitCode verify(const VerifyRequest& asked) {
  refuse_other_input(asked.path, InputKind::run);
  Json found{{"path", asked.path}};
  std::vector<std::string> problems, remarks;
  std::string words;
  if (std::filesystem::is_directory(asked.path)) {
    const CampaignVerification campaign = verify_campaign(CampaignFolder::open(asked.path));
    found["runs"] = campaign.runs;
    found["journal_entries"] = campaign.entries;
    found["torn_last_line"] = campaign.torn_last_line;
    problems = campaign.problems;
    for (std::string& problem : problems_of_coefficients(CampaignFolder::open(asked.path)))
      problems.push_back(std::move(problem));
    remarks = campaign.remarks;
    words = fmt::format("{} runs and {} journal entries{}", campaign.runs, campaign.entries,
                        campaign.torn_last_line ? " (the last line of the journal was cut short and is ignored)" : "");
  } else {
    const Verification run = verify_run(asked.path);
    found["outcome"] = run.outcome == Outcome::complete ? "complete" : "aborted";
    found["samples"] = run.samples;
    found["lost"] = run.lost;
    for (const std::string& problem : run.problems) problems.push_back(with_file(asked.path, problem));
    words = fmt::format("{} run, {} samples, {} lost and accounted for", found["outcome"].get<std::string>(),
                        run.samples, run.lost);
  }
  found["whole"] = problems.empty();
  found["problems"] = problems;
  found["remarks"] = remarks;
  if (asked.json) {
    print_json(found);
  } else {
    for (const std::string& problem : problems) fmt::print("{}\n", problem);
    for (const std::string& remark : remarks) fmt::print(stderr, "kphi: {}\n", remark);
    if (problems.empty()) fmt::print("{}: intact: {}\n", asked.path, words);
  }
  return problems.empty() ? ExitCode::ok : ExitCode::data_rejected;
}

void add(CLI::App& program, ExitCode& exit_code, const char* name, const char* what, const char* example,
         ExitCode (*run)(const VerifyRequest&)) {
  const auto [command, asked] = add_verb<VerifyRequest>(program, exit_code, name, what, example, run);
  add_argument(command, "PATH", asked.path, "run file or campaign folder")->check(kExistingPath);
  command.add_flag("--json", asked.json, "print one JSON object");
}

}  // namespace

void add_info(CLI::App& program, ExitCode& exit_code) {
  add(program, exit_code, "info", "show the contents of a run or campaign folder", "kphi info results/<folder>", info);
}

void add_verify(CLI::App& program, ExitCode& exit_code) {
  add(program, exit_code, "verify", "check a run or campaign folder for damage (exit code 5: damaged)",
      "kphi verify results/<folder>", verify);
}

}  // namespace kphi::commands
