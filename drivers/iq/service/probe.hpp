// Inspects a module at rest: who it is, how well it answers, what is wrong with it; and finds a silent one at another
// baud rate or id.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/finding.hpp"
#include "drivers/iq/exchange/telemetry.hpp"
#include "drivers/iq/service/audit.hpp"
#include "drivers/iq/service/clock_gain.hpp"
#include "drivers/iq/service/dialogue.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::iq {

// Search for a silent module. It never writes a rate or an id, and coasts whatever listens first. Blocking; wall time.

/// In the order in which they are tried: the factory's, the usual, then the rest.
[[nodiscard]] const std::vector<unsigned>& bauds_to_try();

/// The rate at which the module with this id answers; `first` is tried before all others; nullopt: at no rate. About 3
/// s when nothing answers. Throws DeviceError when the port cannot be opened or is lost.
[[nodiscard]] std::optional<unsigned> find_baud(const std::string& device, int module_id, unsigned first = 115200);

/// The ids that answer at this rate, ascending. About 1.3 s. Throws as find_baud does.
[[nodiscard]] std::vector<int> find_ids(const std::string& device, unsigned baud);

struct ProbeSettings {
  Intention intention;                          ///< what the module is audited against
  double module_timeout_s = 0.5;                ///< set in the module as every connection does; not saved
  std::optional<ClockGainSettings> clock_gain;  ///< measure it, which takes as long as it says
  bool search = true;                           ///< a silent module: try other baud rates and ids, 5 s more
};

struct Probe {
  std::optional<AuditRecord> record;  ///< nullopt: the module does not answer
  std::string device;                 ///< the path that was opened
  std::optional<serial::Adapter> adapter;
  Duration round_trip{0};  ///< median, wall time
  Counters counters;
  std::optional<ClockGain> clock_gain;
  std::vector<Finding> findings;  ///< worst first

  [[nodiscard]] bool answers() const noexcept { return record.has_value(); }
  /// For a person: identity, parameters, line, findings; no line feeds.
  [[nodiscard]] std::vector<std::string> lines() const;
};

/// Coasts the motor, sets the communication timeout, saves nothing, changes no baud rate. Failures become findings;
/// nothing is thrown.
[[nodiscard]] Probe probe(const SerialLine& line, const Clock& clock, const ProbeSettings& settings = {});

}  // namespace kphi::iq
