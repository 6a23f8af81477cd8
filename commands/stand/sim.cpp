#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "commands/outputs.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "drivers/sim/bench_server.hpp"
#include "drivers/sim/control_line.hpp"
#include "drivers/sim/physics/stand.hpp"
#include "drivers/sim/truth_log.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::commands {
namespace {

using namespace sim;

struct SimRequest {
  std::string bench;
  std::string truth;
  std::string resolved;
  std::string faults;
  std::string truth_log;
  std::string mount;
  bool status = false;
  bool free_ports = false;
  double clock_gain = 0;
  double reply_latency_us = 0;
  double usb_tick_ms = 0;
  bool legacy = false;
  bool paced = false;
  std::optional<double> time_scale;
  std::optional<std::uint64_t> seed;
};

std::atomic<Server*> running{nullptr};

void stop_running(int) {
  if (Server* server = running.load()) server->request_stop();
}

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw ConfigurationError(path + ": " + what);
}

profiles::BenchConfig load_simulated(const SimRequest& options) {
  profiles::BenchConfig bench = profiles::load_bench(options.bench);
  if (!bench.simulation) refuse(bench.path, "a real bench cannot be simulated; add a `simulation` section");
  if (bench.load_cell || bench.motor)
    refuse(bench.path,
           "kphi sim is a Net Box and an IQ module; start the simulator of `load_cell` and `motor` instead");
  if (bench.simulation->in_process)
    refuse(bench.path, "`simulation.in_process` needs no server; start `kphi run` directly");
  if (bench.simulation->control.empty())
    refuse(bench.path,
           "without `simulation.control` a simulator of another make is meant; add control: a path for the "
           "socket of this one");
  if (bench.thrust_axis != 2 || bench.thrust_sign != 1 || bench.iq.spin != 1) {
    refuse(bench.path,
           "the simulated propellers pull along +Fz and spin counter-clockwise; set `thrust_axis: +Fz` and "
           "`iq.spin: +1`");
  }
  if (options.time_scale) bench.simulation->time_scale = *options.time_scale;
  if (options.seed) bench.simulation->seed = *options.seed;
  if (!options.faults.empty()) bench.simulation->faults = options.faults;
  return bench;
}

void load_supply(const profiles::BenchConfig& bench, const SimRequest& options, ServerSettings& settings) {
  configured(bench.path, [&] {
    const SupplyUri uri = parse_supply_uri(bench.supply->uri);
    auto& supply = *settings.bench.supply;
    supply.model = uri.model;
    supply.slave = uri.slave;
    supply.seed = bench.simulation->seed;
    (void)SupplySlave(supply);  // refuses an unknown model
    settings.supply = uri.addresses;
    if (options.free_ports) settings.supply->port = 0;
  });
}

ServerSettings settings_of(const profiles::BenchConfig& bench, const SimRequest& options) {
  ServerSettings settings;
  settings.bench = daq::simulated_devices(bench);
  if (std::ranges::any_of(settings.bench.faults, [](const Fault& f) { return on_air_sensor(f.kind); }))
    refuse(bench.simulation->faults, "faults of the air sensor need a bench with `simulation.in_process`");
  settings.bench.time_scale = bench.simulation->time_scale;
  settings.bench.oscillator_gain += options.clock_gain;
  settings.bench.module.quirks = options.legacy ? kLegacyFirmware : IqQuirks{};
  settings.bench.module.reply_latency = from_seconds(1e-6 * options.reply_latency_us);
  settings.bench.motor_line_paced = options.paced;
  settings.bench.motor_usb_tick = from_seconds(1e-3 * options.usb_tick_ms);
  settings.bench.netbox.address = bench.netbox.host;
  settings.host = bench.netbox.host;
  settings.rdt_port = options.free_ports ? 0 : bench.netbox.rdt_port;
  settings.http_port = options.free_ports ? 0 : bench.netbox.http_port;
  settings.tcp_port = options.free_ports ? 0 : bench.netbox.tcp_port;
  if (bench.supply) load_supply(bench, options, settings);
  if (!options.truth_log.empty()) {
    settings.bench.keep = FaultInjector::Keep::datagrams;
    settings.bench.motor_keep = IqLine::Keep::replies;
  }
  settings.device = bench.iq.device;
  settings.control = bench.simulation->control;
  return settings;
}

std::string resolved_text(const profiles::BenchConfig& bench, const Addresses& addresses) {
  YAML::Node file = YAML::Load(bench.text);
  file["netbox"]["rdt_port"] = addresses.rdt_port;
  file["netbox"]["http_port"] = addresses.http_port;
  file["netbox"]["tcp_port"] = addresses.tcp_port;
  file["iq"]["device"] = addresses.device;
  if (addresses.supply && addresses.supply->host) {
    const std::size_t query = bench.supply->uri.find('?');
    file["supply"]["uri"] = fmt::format("modbus-tcp:{}:{}{}", *addresses.supply->host, addresses.supply->port,
                                        query == std::string::npos ? "" : bench.supply->uri.substr(query));
  }
  file["simulation"]["control"] = addresses.control;
  file["simulation"]["time_scale"] = fmt::format("{}", bench.simulation->time_scale);
  file["simulation"]["seed"] = bench.simulation->seed;
  // The copy may lie in another folder.
  const std::string &faults = bench.simulation->faults, &motor = bench.simulation->motor;
  if (!faults.empty()) file["simulation"]["faults"] = std::filesystem::absolute(faults).string();
  if (!motor.empty()) file["simulation"]["motor"] = std::filesystem::absolute(motor).string();
  return fmt::format("# written by kphi sim from {}\n{}\n", bench.path, YAML::Dump(file));
}

std::string ready_line(const profiles::BenchConfig& bench, const Addresses& addresses) {
  Json json{{"rdt", fmt::format("{}:{}", addresses.host, addresses.rdt_port)},
            {"http", fmt::format("{}:{}", addresses.host, addresses.http_port)},
            {"tcp", fmt::format("{}:{}", addresses.host, addresses.tcp_port)},
            {"device", addresses.device},
            {"control", addresses.control},
            {"time_scale", bench.simulation->time_scale},
            {"seed", bench.simulation->seed}};
  if (const auto& supply = addresses.supply)
    json["supply"] = supply->device ? *supply->device : fmt::format("{}:{}", addresses.host, supply->port);
  return json.dump();
}

ExitCode send(const profiles::BenchConfig& bench, const std::string& line) {
  const std::string answer = tell(control_path(bench.simulation->control), line);
  fmt::print("{}\n", answer);
  return answer.starts_with("error") ? ExitCode::failure : ExitCode::ok;
}

ExitCode serve(const profiles::BenchConfig& bench, const SimRequest& options) {
  const ServerSettings settings = settings_of(bench, options);
  Server server(settings);
  if (!options.truth_log.empty())
    write_output(options.truth_log, "", json_lines(server.motor_truth()));  // refuses its name now, not at the end
  if (!options.truth.empty())
    write_output(options.truth, truth_yaml(bench.simulation->seed, settings.bench.plant.stand));
  if (!options.resolved.empty()) write_output(options.resolved, resolved_text(bench, server.addresses()));
  running = &server;
  std::signal(SIGINT, stop_running);
  std::signal(SIGTERM, stop_running);
  fmt::print("{}\n", ready_line(bench, server.addresses()));
  std::fflush(stdout);
  fmt::print(stderr, "kphi sim: simulating {} at {} times real time; Ctrl-C ends it\n", bench.path,
             bench.simulation->time_scale);
  server.run();
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  running = nullptr;
  if (!options.truth_log.empty())
    write_output(options.truth_log,
                 json_lines(server.truth()) + server.motion().json_lines() + json_lines(server.motor_truth()));
  if (!bench.simulation->faults.empty()) fmt::print(stderr, "kphi sim: {}\n", summary(server.truth()));
  const auto& unsent = server.unsent();
  if (unsent.datagrams + unsent.motor_bytes > 0) {
    fmt::print(stderr, "kphi sim: dropped because a buffer was full: {} datagrams, {} motor bytes\n", unsent.datagrams,
               unsent.motor_bytes);
  }
  return ExitCode::ok;
}

ExitCode run(const SimRequest& options) {
  const profiles::BenchConfig bench = load_simulated(options);
  if (!options.mount.empty()) return send(bench, "mount " + options.mount);
  if (options.status) return send(bench, "status");
  return serve(bench, options);
}

}  // namespace

void add_sim(CLI::App& program, ExitCode& exit_code) {
  const auto [sim, options] = add_verb<SimRequest>(
      program, exit_code, "sim", "run the simulated bench of a bench file, or control a running one",
      "kphi sim bench.yaml --truth truth.yaml\nkphi sim bench.yaml --mount '5x3 90'", run);
  add_argument(sim, "BENCH", options.bench, "bench file with a `simulation` section");
  add_value(sim, "--truth", "FILE", options.truth,
            "write the true coefficients of the simulated propellers to FILE (YAML)");
  add_value(sim, "--faults", "FILE", options.faults,
            "fault script of wires and devices (YAML; default: the bench file's)");
  sim.add_option("--time-scale", options.time_scale, "bench seconds per second (default: the bench file's)")
      ->check(CLI::Range(0.1, 1000.0));
  sim.add_option("--seed", options.seed, "seed of the noise (default: the bench file's)");
  add_value(sim, "--resolved", "FILE", options.resolved,
            "write a copy of the bench file with the actual addresses to FILE");
  sim.add_flag("--free-ports", options.free_ports,
               "listen on any free ports instead of the bench file's; see --resolved");
  auto* mount = sim.add_option("--mount", options.mount,
                               "tell the running simulator the mounted propeller and occlusion: \"5x3 90\"");
  sim.add_flag("--status", options.status, "print the state of the running simulator as one line of JSON")
      ->excludes(mount);
  begin_group(sim, "Developers: the motor module and its line");
  add_value(sim, "--truth-log", "FILE", options.truth_log,
            "write at exit what became of every datagram, reply and motor command to FILE (JSON lines)");
  sim.add_option("--clock-gain", options.clock_gain,
                 "relative error of the motor module's clock, about 0.005 in a real one (default 0)")
      ->check(CLI::Range(-0.05, 0.05));
  sim.add_option("--reply-latency-us", options.reply_latency_us, "reply latency of the motor module (default 0)")
      ->check(CLI::Range(0.0, 1e6));
  sim.add_option("--usb-tick-ms", options.usb_tick_ms,
                 "latency timer of the motor's serial adapter, 1 or 16 (default 0: none)")
      ->check(CLI::Range(0.0, 255.0));
  sim.add_flag("--paced", options.paced, "transmit the motor's bytes at its baud rate, not at once");
  sim.add_flag("--legacy", options.legacy, "simulate a motor module with old firmware");
}

}  // namespace kphi::commands
