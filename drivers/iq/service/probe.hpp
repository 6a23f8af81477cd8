// Inspects a module at rest: who it is, how well it answers, what is wrong with it; and finds a silent one at another
// baud rate or id.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/finding.hpp"
#include "drivers/iq/exchange/telemetry.hpp"
#include "drivers/iq/service/audit.hpp"
#include "drivers/iq/service/clock_gain.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::iq {

// Search for a silent module. It never writes a rate or an id, and coasts whatever listens first. Blocking; wall time.

/// The rate at which the module with this id answers; `first` is tried before all others; nullopt: at no rate. About 3
/// s when nothing answers. Throws DeviceError when the port cannot be opened or is lost.
[[nodiscard]] std::optional<unsigned> find_baud(const std::string& device, int module_id, unsigned first = 115200);

/// The ids that answer at this rate, ascending. About 1.3 s. Throws as find_baud does.
[[nodiscard]] std::vector<int> find_ids(const std::string& device, unsigned baud);

struct SerialLine {
  std::string device;  ///< as serial::Port takes it
  unsigned baud = 115200;
  int module_id = 0;  ///< 0..62
};

/// Sets what every connection sets, the communication timeout, coast at its end and no song, and reads it back; saves
/// nothing. A fault for each that is not as set; old firmware may lack the last two.
[[nodiscard]] std::vector<Finding> set_timeout(const Ask& ask);

struct ProbeSettings {
  Intention intention;                          ///< what the module is audited against
  std::optional<ClockGainSettings> clock_gain;  ///< measure it, which takes as long as it says
  bool search = true;                           ///< a silent module: try other baud rates and ids, 5 s more
  /// Asked while it connects and before each question; true ends the probe with a fault.
  std::function<bool()> give_up = [] { return false; };
};

struct Probe {
  std::optional<AuditRecord> record;  ///< nullopt: the module does not answer
  std::optional<serial::Adapter> adapter;
  Duration round_trip{0};  ///< median, wall time
  Counters counters;
  std::optional<ClockGain> clock_gain;
  std::vector<Finding> findings;  ///< worst first

  [[nodiscard]] bool answers() const noexcept { return record.has_value(); }
  /// For a person: identity, parameters, line; no line feeds.
  [[nodiscard]] std::vector<std::string> lines() const;
  /// What of it matters most, in one line.
  [[nodiscard]] std::string in_short() const;
  /// The clock's gain, if it was measured, and what to write into a bench file.
  [[nodiscard]] std::vector<std::string> gain_lines() const;
};

/// Coasts the motor, sets the communication timeout, saves nothing, changes no baud rate. Failures become findings;
/// nothing is thrown.
[[nodiscard]] Probe probe(const SerialLine& line, const Clock& clock, const ProbeSettings& settings = {});

}  // namespace kphi::iq
