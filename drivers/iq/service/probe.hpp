// Who the module is, how well it answers, what is wrong with it; and where it is if it does not answer. At rest.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/finding.hpp"
#include "drivers/iq/exchange/reading.hpp"
#include "drivers/iq/service/audit.hpp"
#include "drivers/iq/service/clock_gain.hpp"
#include "drivers/iq/service/dialogue.hpp"
#include "drivers/serial/discovery.hpp"

namespace kphi::iq {

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
