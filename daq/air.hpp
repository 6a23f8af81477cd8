// The air of a bench as the density of which thrust depends: read off by a person, measured by a sensor, or unknown.
#pragma once

#include <optional>
#include <string>

#include "drivers/ambient/air.hpp"
#include "drivers/ambient/ambient_worker.hpp"
#include "profiles/bench.hpp"

namespace kphi::daq {

class AirSource {
 public:
  /// Waits for the sensor's first reading. Throws DeviceError: not there, not measuring; ConfigurationError: no air is
  /// like what was written by hand. `clock` outlives this.
  AirSource(const profiles::AmbientPlace& place, const Clock& clock);
  /// Now; nothing: nobody knows it. A reading older than a minute as a person's clock runs is none.
  [[nodiscard]] std::optional<ambient::Density> density() const;

 private:
  const Clock& clock_;
  std::optional<ambient::Density> manual_;
  std::optional<ambient::AmbientWorker> sensor_;
};

/// "air 1.2041 ± 0.0012 kg/m³".
[[nodiscard]] std::string words_of(const ambient::Density& air);

}  // namespace kphi::daq
