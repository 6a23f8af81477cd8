// The bench file: where the devices are and how they are mounted.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/device_data.hpp"
#include "compensation/units.hpp"
#include "profiles/limits.hpp"

namespace kphi::profiles {

/// What kphi sets in the box; a missing value stays as it is.
struct NetBoxSettings {
  std::optional<double> rate_hz;
  std::optional<int> records_per_datagram;
  std::optional<int> filter_hz;      ///< cutoff of one of the box's filters; 0: none
  std::optional<int> configuration;  ///< slot 0..15; the box's web pages count from 1
};

struct NetBoxConfig {
  std::string host;  ///< name or address
  std::string bind;  ///< address of this computer to speak from; empty: as the kernel routes
  std::uint16_t rdt_port = 49152;
  std::uint16_t http_port = 80;
  std::uint16_t tcp_port = 49151;  ///< one below rdt_port unless the file says otherwise
  double rate_hz = 7000;           ///< RDT output rate expected of the box
  int records_per_datagram = 40;   ///< 1..40; 1 = real-time mode
  NetBoxSettings settings;         ///< rate and records agree with those above
};

/// The module's clock against this computer's, from `kphi devices --clock-gain`: true speed = reported · factor.
struct ClockGain {
  double factor = 1;         ///< module seconds per host second
  double u_factor = 0;       ///< standard uncertainty
  std::string uid;           ///< of the module; empty: unknown
  std::string measured_utc;  ///< ISO 8601; empty: unknown
};

struct MotorConfig {
  std::string device;  ///< /dev/serial/by-id/..., a pty, or a USB adapter: usb:VID:PID[:SERIAL][@PORT]
  unsigned baud = 115200;
  int module_id = 0;         ///< 0..62
  int spin = +1;             ///< +1 counter-clockwise seen from above, -1 clockwise: the sign of commanded speeds
  double telemetry_hz = 50;  ///< speed readings per second of bench time; other quantities take turns
  RadPerSec speed_max;       ///< highest speed that may be commanded
  std::optional<ClockGain> clock_gain;
  std::vector<std::string> accept_without;  ///< what its firmware may lack: power_safety, volts_limit
  std::string capture;  ///< path of a file for all bytes of the line, beside the bench file; empty: none
};

/// Where the bench supply is, and what it is set to.
struct SupplyConfig {
  std::string uri;  ///< modbus-rtu:/dev/..., modbus-tcp:host:port, each with ?baud=, slave=, model=; scpi-tcp:host,
                    ///< scpi-usb:VID:PID
  Volts voltage;    ///< to be set
  Amperes current_limit;  ///< at which it goes over to constant current
  Volts over_voltage;     ///< at which it switches off
  Amperes over_current;   ///< at which it switches off
};

/// What the simulated stand has beside its nominal propellers (bench.schema.json); shares are of k.
struct SimulatedStand {
  struct Law {
    double K_T = 0, intercept = 0, slope_per_deg = 0;  ///< N/(rad/s)²
  };
  struct Plate {
    double named_deg = 0, true_deg = 0;
    std::optional<int> repetition;  ///< nullopt: in all
  };
  std::optional<Law> law;
  double bend = 0, rise_per_krad_s = 0, mounting = 0;
  std::optional<double> zero_walk_n;  ///< after one minute
  double slow_noise_n = 0, slow_noise_s = 1;
  double cell_gain = 1, cell_hysteresis = 0;
  double cell_gain_scatter = 0, clock_scatter = 0;  ///< standard deviations from stand to stand, drawn from the seed
  std::vector<Plate> plates;
};

/// The simulated bench: how fast, from which seed, and the socket that tells it what is mounted.
struct Simulation {
  bool in_process = false;  ///< true: the deterministic bench, virtual time, no transport
  double time_scale = 1;    ///< bench seconds per wall second
  std::uint64_t seed = 1;
  std::string control;  ///< path of the control line (Unix socket); relative to the system's temporary folder
  std::string faults;   ///< path of a fault script; in the file relative to the file's folder; empty: none
  std::string motor;    ///< path of a simulated motor, likewise; empty: the 2306 that is built in
  double air_density_kg_m3 = 1.225;  ///< of the simulated air
  SimulatedStand stand;
  bool durable = false;  ///< in process: records survive a power cut, as on a real bench; costs time
};

/// Read off by a person, with standard uncertainties.
struct ManualAir {
  double temperature_c = 0;
  double pressure_pa = 0;        ///< absolute, at the stand
  double relative_humidity = 0;  ///< 0..1
  double u_temperature_c = 0, u_pressure_pa = 0, u_relative_humidity = 0;
};

/// Where the state of the air comes from; unknown without either.
struct AmbientConfig {
  std::string sensor;  ///< "usb:04d8:00dd", with :SERIAL or @PORT; empty: none
  /// Standard uncertainty of its temperature where it hangs, °C; nullopt: that of its data sheet. Less than that does
  /// not count.
  std::optional<double> u_temperature_c{};
  std::optional<ManualAir> manual;
  [[nodiscard]] bool known() const noexcept { return !sensor.empty() || manual.has_value(); }
};

/// A device whose driver is not one of kphi's own: the driver knows its settings (daq/bench/offered_drivers.hpp).
struct OtherDevice {
  std::string driver;  ///< word by which the driver is offered
  std::string device;  ///< serial port, as in MotorConfig
  unsigned baud = 115200;
  std::map<std::string, double> settings;
};

struct BenchConfig {
  std::string name;
  NetBoxConfig netbox;
  MotorConfig iq;
  std::optional<OtherDevice> load_cell;  ///< instead of a Net Box, of which only the rate holds
  std::optional<OtherDevice> motor;      ///< instead of an IQ module; what both kinds have is in iq
  int thrust_axis = 2;                   ///< 0..2 = Fx, Fy, Fz
  int thrust_sign = +1;                  ///< sign of the axis when the propeller pulls
  std::optional<SupplyConfig> supply;    ///< nullopt: kphi does not switch what powers the motor
  bool supply_sinks_current = false;     ///< what powers the motor takes current back, so a run may end with a ramp
  Limits limits;                         ///< of this stand; the campaign's hold as well
  AmbientConfig ambient;
  std::optional<Simulation> simulation;
  std::string text;  ///< the file, verbatim
  std::string path;

  [[nodiscard]] Origin origin() const { return simulation ? Origin::simulated : Origin::measured; }
};

/// "Net Box 192.168.1.1", "IQ module /dev/ttyUSB0", "hx711 /dev/ttyACM0".
[[nodiscard]] std::string load_cell_words(const BenchConfig& bench);
[[nodiscard]] std::string motor_words(const BenchConfig& bench);

[[nodiscard]] BenchConfig load_bench(const std::string& path);
[[nodiscard]] BenchConfig parse_bench(const std::string& text, const std::string& path);

}  // namespace kphi::profiles
