// At which rate a module speaks, and making it speak at another. A module at the wrong baud looks dead. Each of these
// is an operation of its own, asked for by name; nothing else changes or saves a rate. They block; wall time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/clock.hpp"

namespace kphi::iq {

/// In the order in which they are tried: the factory's, the usual, then the rest.
[[nodiscard]] const std::vector<unsigned>& bauds_to_try();

/// Tries every rate, `first` before all others; coasts what it finds. Nothing: no module with this id at any rate.
/// Throws DeviceError when the port cannot be opened or goes away. About 3 s when nothing answers.
[[nodiscard]] std::optional<unsigned> find_baud(const std::string& device, int module_id, unsigned first = 115200);

struct BaudChange {
  enum class Effect {
    at_once,       ///< the module answered at the new rate straight away
    after_reboot,  ///< it had to be rebooted; volatile settings are lost
    rolled_back,   ///< it was not reliable at the new rate, and is back at the old one
  };
  unsigned from = 0, to = 0;  ///< `to`: what it speaks now
  Effect effect = Effect::at_once;
  int asked = 0, answered = 0;  ///< the trial at the new rate
  [[nodiscard]] std::string summary() const;
};

/// Makes the module speak at `to` and keep it over a restart: its firmware saves a rate when it is set. The motor must
/// coast, else DeviceError. The new rate is tried with many questions; if one of a hundred stays without an answer, the
/// old rate is restored. Throws DeviceError when the port goes away, or the module is not found again at any rate.
[[nodiscard]] BaudChange change_baud(const std::string& device, int module_id, unsigned from, unsigned to);

}  // namespace kphi::iq
