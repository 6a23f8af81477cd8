#include "profiles/bench.hpp"

#include "profiles/profile_reader.hpp"

namespace kphi::profiles {
namespace {

NetBoxPlace read_netbox(const ProfileReader& file) {
  NetBoxPlace place;
  place.host = file.text("/netbox/host");
  place.rdt_port = file.get_or("/netbox/rdt_port", place.rdt_port);
  place.http_port = file.get_or("/netbox/http_port", place.http_port);
  place.rate_hz = file.get_or("/netbox/rate_hz", place.rate_hz);
  place.records_per_datagram = file.get_or("/netbox/records_per_datagram", place.records_per_datagram);
  return place;
}

MotorPlace read_motor(const ProfileReader& file) {
  MotorPlace place;
  place.device = file.text("/iq/device");
  place.baud = file.get_or("/iq/baud", place.baud);
  place.module_id = file.get_or("/iq/module_id", place.module_id);
  place.spin = file.get_or("/iq/spin", place.spin);
  place.telemetry_hz = file.get_or("/iq/telemetry_hz", place.telemetry_hz);
  place.speed_max = from_rpm(file.number("/iq/speed_max_rpm"));
  return place;
}

AmbientPlace read_ambient(const ProfileReader& file) {
  if (!file.has("/ambient/manual")) {
    const std::string sensor = file.text("/ambient");
    return {sensor == "unknown" ? "" : sensor, std::nullopt};
  }
  const auto value = [&](const char* key) { return file.number(std::string("/ambient/manual/") + key); };
  return {"", ManualAir{value("temperature_c"), value("pressure_pa"), value("relative_humidity"),
                        value("u_temperature_c"), value("u_pressure_pa"), value("u_relative_humidity")}};
}

Simulation read_simulation(ProfileReader& file) {
  Simulation simulation;
  simulation.in_process = file.get_or("/simulation/in_process", simulation.in_process);
  simulation.time_scale = file.get_or("/simulation/time_scale", simulation.time_scale);
  simulation.seed = file.get_or("/simulation/seed", simulation.seed);
  simulation.control = file.get_or("/simulation/control", simulation.control);
  if (!simulation.in_process && simulation.control.empty()) {
    file.refuse("/simulation", "control is missing", "add control: a path for the socket, or in_process: true");
  }
  return simulation;
}

}  // namespace

Bench parse_bench(const std::string& text, const std::string& path) {
  ProfileReader file(text, path, FileKind::bench);
  Bench bench;
  bench.name = file.text("/name");
  bench.netbox = read_netbox(file);
  bench.iq = read_motor(file);
  const std::string axis = file.text("/thrust_axis");  // "+Fz"
  bench.thrust_sign = axis[0] == '-' ? -1 : +1;
  bench.thrust_axis = axis[2] - 'x';
  if (file.has("/ambient")) bench.ambient = read_ambient(file);
  if (file.has("/simulation")) bench.simulation = read_simulation(file);
  bench.text = text;
  bench.path = path;
  file.finish();
  return bench;
}

Bench load_bench(const std::string& path) { return parse_bench(read_text(path), path); }

}  // namespace kphi::profiles
