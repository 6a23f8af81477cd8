#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "base/text.hpp"
#include "commands/at_the_bench.hpp"
#include "commands/commands.hpp"
#include "daq/audit/bench_audit.hpp"
#include "daq/bench/air_source.hpp"
#include "daq/bench/device_records.hpp"
#include "daq/bench/offered_drivers.hpp"
#include "daq/campaign/operator.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/hardware/device_locks.hpp"
#include "daq/hardware/live_bench.hpp"
#include "daq/hardware/probe.hpp"
#include "daq/hardware/wake_ups.hpp"
#include "daq/run/console.hpp"
#include "daq/run/run.hpp"
#include "drivers/iq/service/probe.hpp"
#include "drivers/netbox/receive/probe.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"

namespace kphi::commands {
namespace {

using namespace daq;

constexpr const char* kFactoryAddress = "192.168.1.1";

struct DevicesRequest {
  std::string bench;
  std::string campaign;
  bool json = false;
  std::optional<double> clock_gain_s;
  std::optional<double> timing_s;
  bool detailed = false;
  bool switch_on = false;
};

constexpr std::chrono::seconds kBootTime{5};    // of the module, once it has power
constexpr std::chrono::seconds kStreamLook{2};  // at a load cell's samples
constexpr std::chrono::milliseconds kStreamTick{5};

Json to_json(const netbox::Configuration& box) {
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
          {"filter_hz", netbox::filter_cutoff_hz(box) ? Json(*netbox::filter_cutoff_hz(box)) : Json()},
          {"gage_bias", box.gage_bias}};
}

Json to_json(const netbox::Counters& counters, const StreamHealth& health) {
  Json json;
  KPHI_JSON_MEMBERS(json, counters, expected, received, lost_network, lost_host, late, duplicates, reordered,
                    malformed);
  json["jitter_p50_ns"] = std::llround(1e9 * health.jitter_p50_s);
  json["jitter_p99_ns"] = std::llround(1e9 * health.jitter_p99_s);
  KPHI_JSON_MEMBERS(json, health, records_per_second, skew_ppm, queue_high_water);
  return json;
}

netbox::ProbeSettings probe_settings(const DevicesRequest& asked, const std::optional<profiles::BenchConfig>& bench) {
  netbox::ProbeSettings settings;
  if (!bench) return settings;
  settings.tcp_port = bench->netbox.tcp_port;
  settings.intention.rate_hz = bench->netbox.rate_hz;
  settings.intention.records_per_datagram = bench->netbox.records_per_datagram;
  if (!asked.campaign.empty()) settings.intention = intention_of(profiles::load_campaign(asked.campaign), *bench);
  return settings;
}

DeviceAnswer ask_load_cell(const profiles::NetBoxConfig& config, const Clock& clock,
                           const netbox::ProbeSettings& settings) {
  const netbox::Probe probe =
      netbox::probe({config.host, config.rdt_port, config.http_port, config.bind}, clock, settings);
  DeviceAnswer answer{"Net Box " + config.host, probe.answers(), probe.in_short(), probe.lines()};
  if (probe.configuration) answer.details["configuration"] = to_json(*probe.configuration);
  if (probe.streamed) {
    answer.details["stream"] = to_json(probe.counters, probe.health);
    answer.details["noise"] = probe.noise.standard_deviation;
  }
  answer.add(probe.findings);
  return answer;
}

Json to_json(const iq::AuditRecord& module) {
  Json all = {{"uid", module.uid()},
              {"firmware", module.firmware() ? module.firmware()->text() : ""},
              {"hardware", module.hardware() ? module.hardware()->text() : ""},
              {"electronics", module.electronics() ? module.electronics()->text() : ""}};
  auto& parameters = all["parameters"] = Json::object();
  for (const auto& [entry, value] : module.values) parameters[std::string(entry->path)] = value;
  return all;
}

Json to_json(const serial::Adapter& adapter) {
  Json one = {{"device", adapter.device.string()},
              {"specification", adapter.specification()},
              {"words", adapter.words},
              {"socket", adapter.port}};
  if (adapter.latency_timer_ms) one["latency_timer_ms"] = *adapter.latency_timer_ms;
  return one;
}

Json to_json(const iq::Counters& counters) {
  Json json;
  KPHI_JSON_MEMBERS(json, counters, requests, replies, timeouts, late_replies, unasked, wrong_module, crc_errors,
                    wrong_length, discarded_bytes);
  return json;
}

Json to_json(const iq::ClockGain& gain) {
  return {{"factor", gain.factor},         {"u", gain.u_factor},       {"lowest", gain.lowest},
          {"highest", gain.highest},       {"uid", gain.uid},          {"measured_utc", gain.measured_utc},
          {"duration_s", gain.duration_s}, {"readings", gain.readings}};
}

/// What the bench file demands of the module.
iq::ProbeSettings probe_settings(const profiles::MotorConfig& config, std::optional<double> clock_gain_s) {
  iq::ProbeSettings settings;
  settings.intention.speed_max_rad_s = config.speed_max.value();
  settings.intention.accepted_without = config.accept_without;
  settings.intention.clock_unchecked = !config.clock_gain && !clock_gain_s;
  if (config.clock_gain && !clock_gain_s) settings.intention.uid = config.clock_gain->uid;
  if (clock_gain_s) {
    settings.clock_gain.emplace();
    settings.clock_gain->duration_s = *clock_gain_s;
  }
  return settings;
}

DeviceAnswer ask_motor(
    const profiles::MotorConfig& config, const Clock& clock, std::optional<double> clock_gain_s, bool powered,
    const StopAsked& stop_asked = [] { return false; }) {
  iq::ProbeSettings settings = probe_settings(config, clock_gain_s);
  settings.search = powered;
  settings.give_up = stop_asked;
  iq::Probe probe = iq::probe({config.device, config.baud, config.module_id}, clock, settings);
  if (probe.clock_gain) probe.clock_gain->measured_utc = utc_text(clock, clock.now());
  DeviceAnswer answer{"IQ module " + config.device, probe.answers(), probe.in_short(), probe.lines(),
                      probe.gain_lines()};
  if (probe.record) {
    answer.details = to_json(*probe.record);
    answer.details["round_trip_ns"] = probe.round_trip.count();
    answer.details["counters"] = to_json(probe.counters);
  }
  if (probe.adapter) answer.details["adapter"] = to_json(*probe.adapter);
  if (probe.clock_gain) answer.details["clock_gain"] = to_json(*probe.clock_gain);
  answer.add(probe.findings);
  return answer;
}

/// Whether a person wants the supply's output on, so that the module can answer.
bool may_switch_on(const DevicesRequest& asked, const profiles::SupplyConfig& supply) {
  if (asked.switch_on || !isatty(STDIN_FILENO)) return asked.switch_on;
  Terminal terminal(STDIN_FILENO, stderr);
  put(stderr,
      fmt::format(
          "The supply's output is off, and the motor does not answer. Nothing will turn, but it will have {:g} V.\n",
          supply.voltage.value()));
  const auto answer = terminal.ask(
      "Type on and press Enter to switch it on and off again, or only Enter:", [] {}, [] {});
  return understood(answer.line.value_or("")) == "on";
}

/// Asks with the supply's output on for as long as it takes. A signal switches it off; Ctrl-Z stops this program
/// afterwards. Throws Interrupted.
DeviceAnswer ask_with_power(const profiles::BenchConfig& bench, const Clock& clock,
                            const std::function<DeviceAnswer(const StopAsked&)>& ask) {
  const SignalWatch signals;
  const StopAsked stop_asked = [] { return SignalWatch::count() > 0 || SignalWatch::is_suspension_asked(); };
  DeviceAnswer answer{motor_words(bench)};
  try {
    ModulePower power(bench, clock, stop_asked);
    const auto give_up = std::chrono::steady_clock::now() + kBootTime;
    do {
      answer = ask(stop_asked);
    } while (!answer.answers && !stop_asked() && std::chrono::steady_clock::now() < give_up);
    const std::string why = power.off();
    if (stop_asked())
      throw Interrupted(StopWords{.cause = "stopped by request while the motor module was asked",
                                  .state = why.empty() ? "supply: output off" : why});
    answer.add({why.empty() ? Finding{Severity::note, "the supply's output was on to ask it, and is off again", ""}
                            : Finding{Severity::fault, why, "cut the power of the motor at the switch"}});
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& error) {
    require_no_stop(stop_asked, "while the supply was switched on");
    answer.add({{Severity::fault, error.what(), ""}});
  }
  return answer;
}

void ask_about_air(const profiles::BenchConfig& bench, std::vector<DeviceAnswer>& answers) {
  if (!bench.ambient.sensor.empty()) answers.push_back(ask_sensor(bench.ambient.sensor));
  if (bench.ambient.manual) {
    const auto air = AirSource(bench.ambient, SteadyClock()).density();
    answers.push_back(
        {"air, read off by hand", true, words_of(*air), {}, {}, {{"kg_m3", air->kg_m3}, {"u_kg_m3", air->u_kg_m3}}});
  }
  if (!bench.ambient.known())
    fmt::print(stderr, "kphi: {}: air density unknown, so k of different days is not comparable; add ambient:\n",
               bench.path);
}

/// Faults first; what the bench file does not name last.
int rank_of(const DeviceAnswer* answer) {
  const auto worst = answer->worst();
  return answer->wanted ? 1 + (worst ? static_cast<int>(*worst) : 0) : 0;
}

std::string to_text(const DeviceAnswer& answer, bool detailed) {
  const std::array kMarks{answer.answers ? "found" : "off", "ok", "WARN", "FAULT"};
  const std::string state = answer.says.empty() ? answer.answers ? "" : "does not answer" : answer.says;
  std::string text =
      fmt::format("{:<6} {}: {}{}{}\n", kMarks.at(static_cast<std::size_t>(rank_of(&answer))), answer.device, state,
                  state.empty() || answer.in_short.empty() ? "" : "; ", printable(answer.in_short));
  const auto add = [&](const std::string& line) { text += fmt::format("{:<8}{}\n", "", printable(line)); };
  for (const Finding& finding : answer.findings) add(finding.line());
  for (const std::string& line : answer.results) add(line);
  if (detailed)
    for (const std::string& line : answer.lines) add(line);
  return text;
}

void print(const std::vector<DeviceAnswer>& answers, const DevicesRequest& asked) {
  if (asked.json) {
    auto all = Json::array();
    for (const DeviceAnswer& answer : answers) {
      all.push_back({{"device", answer.device}, {"answers", answer.answers}});
      all.back().update(answer.details);
    }
    return print_json(all);
  }
  std::vector<const DeviceAnswer*> worst_first;
  for (const DeviceAnswer& answer : answers) worst_first.push_back(&answer);
  std::ranges::stable_sort(worst_first, std::greater<>(), rank_of);
  for (const DeviceAnswer* answer : worst_first) fmt::print("{}", to_text(*answer, asked.detailed));
  if (!asked.detailed) fmt::print("all they say: --details; how late this computer wakes kphi: --timing\n");
}

WakeUps wake_ups(double seconds) {
  fmt::print(stderr, "kphi: looking {:g} s how late this computer wakes it\n", seconds);
  return measure_wake_ups(seconds);
}

/// A device of another driver: whether it connects, and what it says of itself.
template <class Link, class Describe>
DeviceAnswer ask_other(const std::string& name, Link&& connect, Describe&& describe) {
  DeviceAnswer answer{name, true};
  try {
    const auto link = connect();
    answer.add(link->findings());
    describe(*link, answer);
  } catch (const DeviceError& error) {
    answer.answers = false;
    answer.add({{Severity::fault, error.what(), ""}});
  }
  return answer;
}

/// As a Net Box is looked at: how many samples come, and how they scatter where nothing moves.
void look_at_stream(LoadCellLink& cell, const results::LoadCellScale& scale, DeviceAnswer& answer) {
  (void)cell.start();
  netbox::ZeroEstimate estimate;
  std::vector<LoadCellRecord> batch(4096);
  for (const auto end = std::chrono::steady_clock::now() + kStreamLook; std::chrono::steady_clock::now() < end;
       std::this_thread::sleep_for(kStreamTick))
    for (std::size_t n = cell.take(batch); n > 0; n = cell.take(batch))
      for (std::size_t i = 0; i < n; ++i) estimate.add(batch[i].counts, batch[i].status);
  cell.stop();
  const netbox::ZeroMeasurement noise = estimate.result(to_cell(scale));
  if (const std::string why = cell.failure(); !why.empty() || noise.records < 2)
    return answer.add({{Severity::fault, why.empty() ? "no valid sample arrived" : why, "check its cable"}});
  std::vector<double> deviations;
  for (std::size_t axis = 0; axis < kAxisNames.size(); ++axis) {
    if (scale.range[axis] <= 0) continue;
    deviations.push_back(noise.standard_deviation[axis]);
    if (noise.standard_deviation[axis] == 0)
      answer.add({{Severity::fault,
                   fmt::format("{} repeats one value in all {} samples: it is frozen", kAxisNames[axis], noise.records),
                   "switch the load cell off and on, check its cable"}});
  }
  answer.in_short += fmt::format(", {} samples in {:g} s, noise {:.2g} N", noise.records,
                                 std::chrono::duration<double>(kStreamLook).count(), fmt::join(deviations, " "));
  answer.details["noise"] = deviations;
}

DeviceAnswer ask_other_load_cell(const profiles::BenchConfig& bench, const Clock& clock) {
  return ask_other(
      load_cell_words(bench), [&] { return connect_load_cell(bench, clock); },
      [](LoadCellLink& cell, DeviceAnswer& answer) {
        const results::LoadCellScale scale = cell.scale();
        answer.in_short =
            fmt::format("{}, {:g} Hz, {:g} counts/N", scale.serial, scale.sample_rate_hz, scale.counts_per_newton);
        look_at_stream(cell, scale, answer);
      });
}

DeviceAnswer ask_other_motor(const profiles::BenchConfig& bench, const Clock& clock) {
  return ask_other(
      motor_words(bench), [&] { return connect_motor(bench, clock); },
      [](const MotorLink& motor, DeviceAnswer& answer) { answer.in_short = motor.identity(); });
}

/// Of whatever kind, with the supply's output on for it if a person wants that.
DeviceAnswer ask_any_motor(const DevicesRequest& asked, const profiles::BenchConfig& bench, const Clock& clock,
                           bool unpowered) {
  const auto ask = [&](bool powered, const StopAsked& stop_asked) {
    return bench.motor ? ask_other_motor(bench, clock)
                       : ask_motor(bench.iq, clock, asked.clock_gain_s, powered, stop_asked);
  };
  // A board that has another supply answers all the same.
  DeviceAnswer answer = ask(!unpowered, [] { return false; });
  if (answer.answers || !unpowered) return answer;
  if (may_switch_on(asked, *bench.supply))
    return ask_with_power(bench, clock, [&](const StopAsked& stop_asked) { return ask(false, stop_asked); });
  answer.wanted = asked.clock_gain_s.has_value();
  answer.says = "without power";
  answer.findings.clear();
  answer.add(
      {answer.wanted
           ? Finding{Severity::fault, "clock not measured: the supply's output is off", "give --switch-on"}
           : Finding{Severity::note, "cannot answer while the supply's output is off", "give --switch-on to ask it"}});
  return answer;
}

ExitCode devices(const DevicesRequest& asked) {
  std::optional<profiles::BenchConfig> bench;
  if (!asked.bench.empty()) bench = profiles::load_bench(asked.bench);
  if (bench && bench->simulation && bench->simulation->in_process) {
    fmt::print(stderr, "kphi: {}: simulation.in_process has no devices to ask\n", asked.bench);
    return ExitCode::ok;
  }
  if (bench) announce_origin(*bench);
  if (bench) require_simulator(*bench);
  // Asking starts a stream and resets a module, which would disturb a running measurement.
  const auto locks = lock_devices(bench ? lock_names(*bench)
                                        : std::vector<std::string>{fmt::format("Net Box {}:49152", kFactoryAddress)});
  const SteadyClock clock(bench && bench->simulation ? bench->simulation->time_scale : 1.0);
  profiles::NetBoxConfig factory;
  factory.host = kFactoryAddress;
  std::vector<DeviceAnswer> answers;
  answers.push_back(bench && bench->load_cell
                        ? ask_other_load_cell(*bench, clock)
                        : ask_load_cell(bench ? bench->netbox : factory, clock, probe_settings(asked, bench)));
  if (bench && bench->supply) answers.push_back(ask_supply(*bench->supply, clock));
  const bool unpowered = bench && bench->supply && answers.back().details.value("output", true) == false;
  if (bench) answers.push_back(ask_any_motor(asked, *bench, clock, unpowered));
  if (bench) ask_about_air(*bench, answers);
  for (DeviceAnswer& answer : ask_usb(answers)) answers.push_back(std::move(answer));
  if (bench && asked.timing_s) answers.push_back(answer_of(wake_ups(*asked.timing_s), *bench));
  print(answers, asked);
  if (!bench) fmt::print(stderr, "kphi: no bench file, so only the Net Box's factory address was tried; use --bench\n");
  for (const DeviceAnswer& answer : answers)
    if (answer.wanted && !answer.answers) return ExitCode::no_device;
  const bool faulty =
      std::ranges::any_of(answers, [](const auto& one) { return one.wanted && one.worst() == Severity::fault; });
  return faulty ? ExitCode::failure : ExitCode::ok;
}

}  // namespace

void add_devices(CLI::App& program, ExitCode& exit_code) {
  const auto [command, asked] = add_verb<DevicesRequest>(program, exit_code, "devices",
                                                         "find and identify the devices, list what is wrong with them",
                                                         "kphi devices --bench my_bench.yaml", devices);
  CLI::Option* bench =
      add_value(command, "--bench", "FILE", asked.bench, "bench file (default: try only the Net Box's factory address)")
          ->check(kExistingFile);
  add_value(command, "--clock-gain", "SECONDS", asked.clock_gain_s,
            "compare the motor module's clock with this computer's, for SECONDS of bench time")
      ->expected(0, 1)
      ->default_str("60")
      ->check(CLI::Range(1.0, 1e5))
      ->needs(bench);
  add_value(command, "--campaign", "FILE", asked.campaign,
            "campaign file: check that the box's rate and ranges suit its speeds")
      ->needs(bench)
      ->check(kExistingFile);
  add_value(command, "--timing", "SECONDS", asked.timing_s, "measure how late this computer wakes kphi, for SECONDS")
      ->expected(0, 1)
      ->default_str("10")
      ->check(CLI::Range(0.1, 3600.0))
      ->needs(bench);
  command.add_flag("--details", asked.detailed, "print all that the devices say");
  command
      .add_flag("--switch-on", asked.switch_on,
                "switch the supply's output on while the motor module is asked, if it is off; nothing turns")
      ->needs(bench);
  command.add_flag("--json", asked.json, "print one JSON array");
}

}  // namespace kphi::commands
