// Who is there, how well it answers, what is wrong with it: a module looked at for a moment, at rest.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/finding.hpp"
#include "drivers/iq/audit.hpp"
#include "drivers/iq/clock_gain.hpp"
#include "drivers/iq/reading.hpp"
#include "drivers/iq/serial_dialogue.hpp"
#include "drivers/serial/discovery.hpp"

namespace kphi::iq {

struct ProbeSettings {
  Intention intention;                          ///< what the module is audited against
  double module_timeout_s = 0.5;                ///< set in the module as every connection does; not saved
  std::optional<ClockGainSettings> clock_gain;  ///< measure it, which takes as long as it says
};

struct Probe {
  std::optional<AuditRecord> record;  ///< nothing: the module does not answer
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

/// Coasts the motor, sets the communication timeout, saves nothing. What fails is a finding, nothing is thrown.
[[nodiscard]] Probe probe(const DialoguePlace& place, const Clock& clock, const ProbeSettings& settings = {});

}  // namespace kphi::iq
