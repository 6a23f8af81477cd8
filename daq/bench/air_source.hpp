// Air density of a bench, on which thrust depends: read off by a person, measured by a sensor, or unknown. kphi never
// assumes standard air.
#pragma once

#include <optional>
#include <string>

#include "drivers/ambient/air.hpp"
#include "drivers/ambient/ambient_worker.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::daq {

class AirSource {
 public:
  /// Waits for the sensor's first reading. Throws DeviceError if it is missing or silent, ConfigurationError for
  /// impossible values written by hand. `clock` must outlive this.
  AirSource(const profiles::AmbientConfig& config, const Clock& clock);
  /// Current air density; nullopt if unknown, or if the reading is older than a minute (wall clock).
  [[nodiscard]] std::optional<ambient::Density> density() const;

 private:
  const Clock& clock_;
  const profiles::AmbientConfig config_;
  std::optional<ambient::Density> manual_;
  std::optional<ambient::AmbientWorker> sensor_;
};

/// As a sensor measured it, less certain where the bench file says so.
[[nodiscard]] ambient::Air as_placed(ambient::Air air, const profiles::AmbientConfig& config);

/// "air 1.2041 ± 0.0012 kg/m³".
[[nodiscard]] std::string words_of(const ambient::Density& air);

}  // namespace kphi::daq
