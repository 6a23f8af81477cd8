// The simulated bench: physics, load cell box and motor module joined on one time. Single-threaded, no I/O, no clock:
// the same inputs at the same bench times give the same bytes. The server puts transports around it; a deterministic
// campaign joins it directly with the drivers' sessions.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "drivers/sim/iq/device.hpp"
#include "drivers/sim/iq/line.hpp"
#include "drivers/sim/netbox/device.hpp"
#include "drivers/sim/netbox/fault_injector.hpp"
#include "drivers/sim/physics/plant.hpp"
#include "drivers/sim/script/faults.hpp"
#include "drivers/sim/supply/slave.hpp"
#include "drivers/sim/usb/bme280.hpp"

namespace kphi::sim {

struct BenchSettings {
  std::uint64_t seed = 1;
  Instant begin{0};       ///< bench time at which it is switched on
  double time_scale = 1;  ///< stretches the module's communication timeout, nothing else: it is a deadline of wall time
  NetBoxSettings netbox;
  double oscillator_gain = 0;  ///< see IqSettings; 0 unless asked for
  IqSettings module;           ///< its oscillator_gain, time_scale and seed are replaced by those above
  PlantParameters plant;
  std::optional<SupplySettings> supply;  ///< powers the motor, off at first; nullopt: the supply of plant.motor
  FaultScript faults;                    ///< of all devices; drawn from `seed`
  FaultInjector::Keep keep = FaultInjector::Keep::totals;
  bool motor_line_paced = false;  ///< see IqLineSettings
  Duration motor_usb_tick{0};     ///< see IqLineSettings
  IqLine::Keep motor_keep = IqLine::Keep::totals;
  TrueAir air{18, 102689, 0.45};  ///< around its sensor, which the bench itself does not have; 1.225 kg/m³
};

class SimulatedBench {
 public:
  explicit SimulatedBench(const BenchSettings& settings);

  /// Occlusion in degrees, [0, 360). Throws std::invalid_argument for an unknown propeller, an angle out of range, or
  /// while the shaft turns faster than 5 rad/s.
  void mount(const std::string& propeller_id, double occlusion_deg);
  /// A weight pulls along x, y or z (0..2), N; 0: none. Throws std::invalid_argument.
  void hang(int axis, double newtons);
  /// "5x3 90"; empty for the bare motor, as after power-up.
  [[nodiscard]] std::string mounted() const { return mounted_; }

  /// Physics up to and including `now`, 7000 internal ticks per second; the past is ignored. Bytes for the devices are
  /// given to them after this was called with the time of their arrival.
  void advance(Instant now);

  /// Its datagrams and pages have only the faults of the box itself; see wire().
  [[nodiscard]] NetBoxDevice& netbox() noexcept { return netbox_; }
  [[nodiscard]] FaultInjector& wire() noexcept { return wire_; }
  /// The module itself, for joining a driver without the line.
  [[nodiscard]] IqDevice& motor() noexcept { return motor_; }
  /// The line with its rate, adapter and faults; advance() moves it on.
  [[nodiscard]] IqLine& motor_line() noexcept { return motor_line_; }
  /// nullptr: this bench has none.
  [[nodiscard]] SupplySlave* supply() noexcept { return supply_ ? &*supply_ : nullptr; }
  [[nodiscard]] const Plant& plant() const noexcept { return plant_; }
  [[nodiscard]] std::uint64_t ticks() const noexcept { return ticks_; }

 private:
  std::optional<SupplySlave> supply_;
  Plant plant_;
  NetBoxDevice netbox_;
  FaultInjector wire_;
  IqDevice motor_;
  IqLine motor_line_;
  std::string mounted_;
  std::uint64_t ticks_ = 0;
  Instant tick_at_{0};
};

}  // namespace kphi::sim
