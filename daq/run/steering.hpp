// Somebody who sets the speed by hand, instead of a plan.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "compensation/units.hpp"

namespace kphi::daq {

enum class Key : std::uint8_t { up, down, hold, stop };

/// The runner's thread.
class Steering {
 public:
  virtual ~Steering() = default;
  /// The speed that is wanted now, unsigned; nullopt: the motor is to stop. Called on every tick, with the speed that
  /// is commanded at that time.
  [[nodiscard]] virtual std::optional<RadPerSec> wanted(Instant now, RadPerSec commanded) = 0;
  /// Why it is to stop.
  [[nodiscard]] virtual std::string why() const = 0;
};

}  // namespace kphi::daq
