// Examines a box for a few seconds: identity, quality of the stream, findings.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/finding.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/receive/audit.hpp"
#include "drivers/netbox/receive/load.hpp"
#include "drivers/netbox/receive/load_cell.hpp"
#include "drivers/netbox/stream/health.hpp"

namespace kphi::netbox {

struct ProbeSettings {
  std::uint16_t tcp_port = 49151;
  std::chrono::nanoseconds stream = std::chrono::seconds(2);  ///< wall time
  std::chrono::nanoseconds tcp_timeout = std::chrono::seconds(1);
  Intention intention;  ///< what the configuration is audited against
};

struct Probe {
  std::optional<Configuration> configuration;  ///< nothing: the box does not answer
  bool streamed = false;
  Counters counters;
  StreamHealth health;
  std::string receive_buffer;
  ZeroMeasurement noise;  ///< of the streamed records: where nothing moves, their deviation is the cell's noise
  std::vector<Event> events;
  std::vector<Finding> findings;  ///< worst first

  [[nodiscard]] bool answers() const noexcept { return configuration.has_value() && streamed; }
  /// For a person: identity, settings, stream; no line feeds.
  [[nodiscard]] std::vector<std::string> lines() const;
  /// What of it matters most, in one line.
  [[nodiscard]] std::string in_short() const;
};

/// Blocks for `stream` and a few seconds more when something does not answer. Stops a stream of another client: do not
/// probe a box in use. Writes no setting; what fails is a finding, nothing is thrown.
[[nodiscard]] Probe probe(const Address& address, const Clock& clock, const ProbeSettings& settings = {});

}  // namespace kphi::netbox
