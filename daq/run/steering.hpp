// Somebody who sets the speed by hand, instead of a plan.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "compensation/units.hpp"

namespace kphi::daq {

enum class Key : std::uint8_t { up, down, hold, stop };

/// Keys of whoever is there. The runner's thread.
class Keys {
 public:
  virtual ~Keys() = default;
  /// From now on keys count, also those pressed since the last answer.
  virtual void begin() {}
  /// The oldest that was pressed; does not wait.
  [[nodiscard]] virtual std::optional<Key> next() = 0;
  /// Once all words are on the screen, no key counts that was pressed before: the next one answers them. `poll` is
  /// called while it waits, and ends the wait by an exception.
  virtual void forget(const std::function<void()>& poll) = 0;
};

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
