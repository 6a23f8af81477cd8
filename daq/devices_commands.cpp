#include "daq/devices_commands.hpp"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daq/load_cell_audit.hpp"
#include "drivers/device_error.hpp"
#include "drivers/iq/motor.hpp"
#include "drivers/netbox/probe.hpp"
#include "profiles/bench.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {
namespace {

constexpr int kOk = 0;
constexpr int kNoDevice = 3;
constexpr const char* kFactoryAddress = "192.168.1.1";

struct Asked {
  std::string bench;
  std::string campaign;
  bool json = false;
};

struct Answer {
  std::string device;
  bool answers = false;
  std::vector<std::string> lines;
  nlohmann::ordered_json details;
};

nlohmann::ordered_json to_json(const netbox::Configuration& box) {
  return {{"product", box.product},
          {"firmware", box.firmware},
          {"calibration", box.calibration_serial},
          {"slot", box.slot},
          {"counts_per_n", box.counts_per_newton},
          {"counts_per_nm", box.counts_per_newton_metre},
          {"range", box.range},
          {"rate_hz", box.rdt_rate_hz},
          {"records_per_datagram", box.records_per_datagram},
          {"rdt_enabled", box.rdt_enabled},
          {"filter_hz", netbox::filter_cutoff_hz(box.filter_code).value_or(0)},
          {"gage_bias", box.gage_bias}};
}

nlohmann::ordered_json to_json(const netbox::Counters& counters, const netbox::Health& health) {
  return {{"expected", counters.expected},
          {"received", counters.received},
          {"lost_network", counters.lost_network},
          {"lost_host", counters.lost_host},
          {"late", counters.late},
          {"duplicates", counters.duplicates},
          {"reordered", counters.reordered},
          {"malformed", counters.malformed},
          {"records_per_second", health.records_per_second},
          {"jitter_p50_ns", health.jitter_p50_ns},
          {"jitter_p99_ns", health.jitter_p99_ns},
          {"skew_ppm", health.skew_ppm},
          {"queue_high_water", health.queue_high_water}};
}

const char* word(netbox::Severity severity) {
  return severity == netbox::Severity::fault ? "fault" : severity == netbox::Severity::warning ? "warning" : "note";
}

netbox::ProbeSettings probe_settings(const Asked& asked, const std::optional<profiles::Bench>& bench) {
  netbox::ProbeSettings settings;
  if (!bench) return settings;
  settings.tcp_port = bench->netbox.tcp_port;
  settings.intention.rate_hz = bench->netbox.rate_hz;
  settings.intention.records_per_datagram = bench->netbox.records_per_datagram;
  if (!asked.campaign.empty()) settings.intention = intention_of(profiles::load_campaign(asked.campaign), *bench);
  return settings;
}

Answer ask_load_cell(const profiles::NetBoxPlace& place, const Clock& clock, const netbox::ProbeSettings& settings) {
  const netbox::Probe probe = netbox::probe({place.host, place.rdt_port, place.http_port}, clock, settings);
  Answer answer{"Net Box " + place.host, probe.answers(), probe.lines(), {}};
  if (probe.configuration) answer.details["configuration"] = to_json(*probe.configuration);
  if (probe.streamed) answer.details["stream"] = to_json(probe.counters, probe.health);
  for (const netbox::Finding& finding : probe.findings) {
    answer.details["findings"].push_back(
        {{"severity", word(finding.severity)}, {"what", finding.what}, {"next_move", finding.next_move}});
  }
  return answer;
}

Answer ask_motor(const profiles::MotorPlace& place, const Clock& clock) {
  Answer answer{"IQ module " + place.device, false, {}, {}};
  try {
    iq::Settings settings;
    settings.module_id = place.module_id;
    settings.telemetry_hz = place.telemetry_hz;
    const iq::Motor motor(place.device, place.baud, settings, clock);
    const iq::Identity identity = motor.identity();
    answer.answers = true;
    answer.lines.push_back(identity.summary());
    answer.details = {{"firmware", identity.firmware_text()},
                      {"uid", identity.uid_text()},
                      {"pole_pairs", identity.pole_pairs},
                      {"fault", identity.fault_now}};
  } catch (const DeviceError& error) {
    answer.lines.push_back(std::string("fault: ") + error.what());
    answer.details = {{"error", error.what()}};
  }
  return answer;
}

void print(const std::vector<Answer>& answers, bool json) {
  if (json) {
    auto all = nlohmann::ordered_json::array();
    for (const Answer& answer : answers) {
      nlohmann::ordered_json one = {{"device", answer.device}, {"answers", answer.answers}};
      one.update(answer.details);
      all.push_back(one);
    }
    fmt::print("{}\n", all.dump(2));
    return;
  }
  for (const Answer& answer : answers) {
    fmt::print("{}: {}\n", answer.device, answer.answers ? "answers" : "does not answer");
    for (const std::string& line : answer.lines) fmt::print("  {}\n", line);
  }
}

int devices(const Asked& asked) {
  std::optional<profiles::Bench> bench;
  if (!asked.bench.empty()) bench = profiles::load_bench(asked.bench);
  if (bench && bench->simulation && bench->simulation->in_process) {
    fmt::print(stderr, "kphi: {} is simulated inside the program: it has no devices to ask\n", asked.bench);
    return kOk;
  }
  const SteadyClock clock(bench && bench->simulation ? bench->simulation->time_scale : 1.0);
  profiles::NetBoxPlace factory;
  factory.host = kFactoryAddress;
  std::vector<Answer> answers;
  answers.push_back(ask_load_cell(bench ? bench->netbox : factory, clock, probe_settings(asked, bench)));
  if (bench) answers.push_back(ask_motor(bench->iq, clock));
  print(answers, asked.json);
  if (!bench) fmt::print(stderr, "kphi: no bench file: only the Net Box's factory address was asked; use --bench\n");
  for (const Answer& answer : answers) {
    if (!answer.answers) return kNoDevice;
  }
  return kOk;
}

}  // namespace

void add_devices(CLI::App& program, int& exit_code) {
  auto asked = std::make_shared<Asked>();
  CLI::App* command = program.add_subcommand("devices", "what answers, who it is, what is wrong with it");
  command->add_option("--bench", asked->bench, "bench file; without it the Net Box's factory address is asked")
      ->check(CLI::ExistingFile);
  command->add_option("--campaign", asked->campaign, "campaign file: are rate and ranges good for its speeds?")
      ->needs("--bench")
      ->check(CLI::ExistingFile);
  command->add_flag("--json", asked->json, "for a script");
  command->callback([asked, &exit_code] { exit_code = devices(*asked); });
}

}  // namespace kphi::daq
