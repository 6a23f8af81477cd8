#include "profiles/bench_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "profiles/profile_reader.hpp"

namespace kphi::profiles {
namespace {

/// A value to be set is also the one expected; another one beside it is a contradiction.
template <class T>
void agree(ProfileReader& file, const std::string& key, const std::optional<T>& set, T& expected) {
  if (!set) return;
  if (file.has("/netbox/" + key) && expected != *set) {
    file.refuse("/netbox/settings/" + key, fmt::format("{} contradicts the {} of netbox.{}", *set, expected, key),
                "write the same, or remove netbox." + key);
  }
  expected = *set;
}

NetBoxConfig read_netbox(ProfileReader& file) {
  NetBoxConfig config;
  config.host = file.text("/netbox/host");
  config.bind = file.get_or("/netbox/bind", config.bind);
  config.rdt_port = file.get_or("/netbox/rdt_port", config.rdt_port);
  config.http_port = file.get_or("/netbox/http_port", config.http_port);
  config.tcp_port = file.get_or("/netbox/tcp_port", static_cast<std::uint16_t>(config.rdt_port - 1));
  config.rate_hz = file.get_or("/netbox/rate_hz", config.rate_hz);
  config.records_per_datagram = file.get_or("/netbox/records_per_datagram", config.records_per_datagram);
  config.settings = {file.find<double>("/netbox/settings/rate_hz"),
                     file.find<int>("/netbox/settings/records_per_datagram"),
                     file.find<int>("/netbox/settings/filter_hz"), file.find<int>("/netbox/settings/configuration")};
  agree(file, "rate_hz", config.settings.rate_hz, config.rate_hz);
  agree(file, "records_per_datagram", config.settings.records_per_datagram, config.records_per_datagram);
  return config;
}

ClockGain read_clock_gain(const ProfileReader& file) {
  static_cast<void>(file.find<double>("/iq/clock_gain/duration_s"));  // for people only
  return {file.number("/iq/clock_gain/factor"), file.number("/iq/clock_gain/u"),
          file.get_or<std::string>("/iq/clock_gain/uid", ""),
          file.get_or<std::string>("/iq/clock_gain/measured_utc", "")};
}

MotorConfig read_module(const ProfileReader& file, const std::filesystem::path& folder) {
  MotorConfig config;
  config.device = file.text("/iq/device");
  config.baud = file.get_or("/iq/baud", config.baud);
  config.module_id = file.get_or("/iq/module_id", config.module_id);
  config.spin = file.get_or("/iq/spin", config.spin);
  config.telemetry_hz = file.get_or("/iq/telemetry_hz", config.telemetry_hz);
  config.speed_max = from_rpm(file.number("/iq/speed_max_rpm"));
  if (file.has("/iq/clock_gain")) config.clock_gain = read_clock_gain(file);
  for (std::size_t i = 0; file.has(fmt::format("/iq/accept_without/{}", i)); ++i)
    config.accept_without.push_back(file.text(fmt::format("/iq/accept_without/{}", i)));
  if (file.has("/iq/capture")) config.capture = (folder / file.text("/iq/capture")).string();
  return config;
}

OtherDevice read_device(const ProfileReader& file, const std::string& at) {
  OtherDevice other{file.text(at + "/driver"), file.text(at + "/device"), 115200, {}};
  other.baud = file.get_or(at + "/baud", other.baud);
  if (file.has(at + "/settings"))
    for (const std::string& key : file.keys(at + "/settings"))
      other.settings[key] = file.number(at + "/settings/" + key);
  return other;
}

/// Of the two that name one device.
void require_one(ProfileReader& file, const std::string& own, const std::string& other, const char* what) {
  if (file.has("/" + own) == file.has("/" + other))
    file.refuse(file.has("/" + own) ? "/" + other : "/name",
                fmt::format("{} and {} are {}", own, other, file.has("/" + own) ? "both given" : "missing"),
                fmt::format("write one of them: {}", what));
}

void read_load_cell(ProfileReader& file, BenchConfig& bench) {
  require_one(file, "netbox", "load_cell", "netbox for an ATI Net Box, load_cell for another driver's");
  if (file.has("/netbox")) bench.netbox = read_netbox(file);
  if (!file.has("/load_cell")) return;
  bench.load_cell = read_device(file, "/load_cell");
  bench.netbox.rate_hz = file.number("/load_cell/rate_hz");
  bench.netbox.records_per_datagram = 1;
}

void read_motor(ProfileReader& file, const std::filesystem::path& folder, BenchConfig& bench) {
  require_one(file, "iq", "motor", "iq for an IQ module, motor for another driver's");
  if (file.has("/iq")) bench.iq = read_module(file, folder);
  if (!file.has("/motor")) return;
  bench.motor = read_device(file, "/motor");
  bench.iq.device = bench.motor->device;
  bench.iq.baud = bench.motor->baud;
  bench.iq.spin = file.get_or("/motor/spin", bench.iq.spin);
  bench.iq.telemetry_hz = file.get_or("/motor/telemetry_hz", bench.iq.telemetry_hz);
  bench.iq.speed_max = from_rpm(file.number("/motor/speed_max_rpm"));
}

SupplyConfig read_supply(ProfileReader& file) {
  const SupplyConfig config{file.text("/supply/uri"), Volts(file.number("/supply/voltage_v")),
                            Amperes(file.number("/supply/current_limit_a")),
                            Volts(file.number("/supply/over_voltage_v")),
                            Amperes(file.number("/supply/over_current_a"))};
  if (!(config.over_voltage.value() > config.voltage.value())) {
    file.refuse(
        "/supply/over_voltage_v",
        fmt::format("{:g} V is not above the {:g} V of voltage_v", config.over_voltage.value(), config.voltage.value()),
        "write more: it would switch off at once");
  }
  if (config.over_current.value() < config.current_limit.value()) {
    file.refuse("/supply/over_current_a",
                fmt::format("{:g} A is below the {:g} A of current_limit_a", config.over_current.value(),
                            config.current_limit.value()),
                "write that or more");
  }
  return config;
}

AmbientConfig read_ambient(ProfileReader& file) {
  if (file.has("/ambient/manual") && file.has("/ambient/sensor"))
    file.refuse("/ambient/sensor", "manual values are given, too", "write one of them");
  if (file.has("/ambient/sensor"))
    return {file.text("/ambient/sensor"), file.find<double>("/ambient/u_temperature_c"), std::nullopt};
  if (file.is_text("/ambient")) {
    const std::string sensor = file.text("/ambient");
    return {sensor == "unknown" ? "" : sensor, std::nullopt, std::nullopt};
  }
  if (!file.has("/ambient/manual")) {
    file.refuse("/ambient", "neither sensor nor manual is given", "write one of them");
    return {};
  }
  const auto value = [&](const char* key) { return file.number(std::string("/ambient/manual/") + key); };
  return {"", std::nullopt,
          ManualAir{value("temperature_c"), value("pressure_pa"), value("relative_humidity"), value("u_temperature_c"),
                    value("u_pressure_pa"), value("u_relative_humidity")}};
}

SimulatedStand read_stand(const ProfileReader& file) {
  const std::string at = "/simulation/stand";
  SimulatedStand stand;
  if (file.has(at + "/law"))
    stand.law = {file.number(at + "/law/K_T_n_s2_per_rad2"), file.number(at + "/law/intercept_n_s2_per_rad2"),
                 file.number(at + "/law/slope_n_s2_per_rad2_deg")};
  stand.bend = file.get_or(at + "/bend", stand.bend);
  stand.rise_per_krad_s = file.get_or(at + "/rise_per_krad_s", stand.rise_per_krad_s);
  stand.mounting = file.get_or(at + "/mounting", stand.mounting);
  stand.zero_walk_n = file.find<double>(at + "/zero_walk_n");
  stand.slow_noise_n = file.get_or(at + "/slow_noise_n", stand.slow_noise_n);
  stand.slow_noise_s = file.get_or(at + "/slow_noise_s", stand.slow_noise_s);
  stand.cell_gain = file.get_or(at + "/cell_gain", stand.cell_gain);
  stand.cell_gain_scatter = file.get_or(at + "/cell_gain_scatter", stand.cell_gain_scatter);
  stand.clock_scatter = file.get_or(at + "/clock_scatter", stand.clock_scatter);
  stand.cell_hysteresis = file.get_or(at + "/cell_hysteresis", stand.cell_hysteresis);
  for (std::size_t i = 0; file.has(fmt::format("{}/plates/{}", at, i)); ++i) {
    const std::string plate = fmt::format("{}/plates/{}/", at, i);
    stand.plates.push_back(
        {file.number(plate + "named_deg"), file.number(plate + "true_deg"), file.find<int>(plate + "repetition")});
  }
  return stand;
}

Simulation read_simulation(ProfileReader& file, const std::filesystem::path& folder) {
  Simulation simulation;
  simulation.in_process = file.get_or("/simulation/in_process", simulation.in_process);
  simulation.time_scale = file.get_or("/simulation/time_scale", simulation.time_scale);
  simulation.seed = file.get_or("/simulation/seed", simulation.seed);
  simulation.control = file.get_or("/simulation/control", simulation.control);
  if (file.has("/simulation/faults")) simulation.faults = (folder / file.text("/simulation/faults")).string();
  if (file.has("/simulation/motor")) simulation.motor = (folder / file.text("/simulation/motor")).string();
  simulation.durable = file.get_or("/simulation/durable", simulation.durable);
  simulation.air_density_kg_m3 = file.get_or("/simulation/air_density_kg_m3", simulation.air_density_kg_m3);
  simulation.stand = read_stand(file);
  const bool whole = !simulation.in_process || !simulation.faults.empty();
  if (whole &&
      std::ranges::any_of(simulation.stand.plates, [](const auto& plate) { return plate.repetition.has_value(); }))
    file.refuse("/simulation/stand/plates", "a bench that lives through the campaign does not know its repetitions",
                "leave repetition out, or set in_process: true without faults");
  return simulation;
}

}  // namespace

BenchConfig parse_bench(const std::string& text, const std::string& path) {
  ProfileReader file(text, path, FileKind::bench);
  BenchConfig bench;
  bench.name = file.text("/name");
  read_load_cell(file, bench);
  read_motor(file, std::filesystem::path(path).parent_path(), bench);
  const std::string axis = file.text("/thrust_axis");  // "+Fz"
  bench.thrust_sign = axis[0] == '-' ? -1 : +1;
  bench.thrust_axis = axis[2] - 'x';
  if (file.has("/supply")) bench.supply = read_supply(file);
  bench.supply_sinks_current = file.get_or("/supply_sinks_current", bench.supply_sinks_current);
  bench.limits = read_limits(file, "/supply/voltage_v");
  if (file.has("/ambient")) bench.ambient = read_ambient(file);
  if (file.has("/simulation")) bench.simulation = read_simulation(file, std::filesystem::path(path).parent_path());
  if (bench.simulation && bench.simulation->in_process && (bench.load_cell || bench.motor))
    file.refuse("/simulation/in_process", "a bench in this process has a Net Box and an IQ module",
                "write netbox and iq, or simulate the devices of other drivers by their own simulators");
  bench.text = text;
  bench.path = path;
  file.finish();
  return bench;
}

std::string load_cell_words(const BenchConfig& bench) {
  return bench.load_cell ? bench.load_cell->driver + " " + bench.load_cell->device : "Net Box " + bench.netbox.host;
}

std::string motor_words(const BenchConfig& bench) {
  return bench.motor ? bench.motor->driver + " " + bench.motor->device : "IQ module " + bench.iq.device;
}

BenchConfig load_bench(const std::string& path) { return parse_bench(read_text(path), path); }

}  // namespace kphi::profiles
