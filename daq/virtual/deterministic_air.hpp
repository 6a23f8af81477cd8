// The simulated sensor of the air behind its simulated bridge, joined to the drivers without a bus, in virtual time.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "drivers/ambient/air.hpp"
#include "drivers/sim/usb/function.hpp"
#include "drivers/sim/usb/mcp2221.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::daq {

class DeterministicAir {
 public:
  /// Waits for the first reading, in its own time: on a live bench another thread does. Throws DeviceError without a
  /// reading. `bench` outlives this.
  DeterministicAir(const Clock& bench, const sim::TrueAir& air, sim::FaultScript faults,
                   const profiles::AmbientConfig& config = {});
  ~DeterministicAir();

  /// Call it whenever time has passed. Measures every five seconds; after a failure it opens the sensor again, after
  /// longer and longer pauses.
  void look();
  /// Of the newest reading; nullopt if that is older than a minute.
  [[nodiscard]] std::optional<ambient::Density> density() const;

 private:
  class Sensor;
  void measure();

  const Clock& bench_;
  const profiles::AmbientConfig config_;
  ManualClock time_;  ///< of the sensor's thread, which may be ahead of the bench while it waits
  sim::UsbFaults faults_;
  sim::Mcp2221 bridge_;
  std::unique_ptr<Sensor> sensor_;
  Instant next_{0};
  Duration pause_;
  std::optional<ambient::Density> newest_;
  Instant newest_at_{0};
  std::string failure_;
};

}  // namespace kphi::daq
