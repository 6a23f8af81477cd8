#include "daq/run/box_configuration.hpp"

#include <fmt/format.h>

#include "base/error.hpp"

namespace kphi::daq {
namespace {

using results::EventKind;

results::StreamEvent event_of(EventKind kind, Instant at, const std::string& what) {
  return {kind, at.count(), 0, fmt::format("{:.3f} s: {}", to_seconds(at), what)};
}

}  // namespace

netbox::Changes changes_since(const netbox::Configuration& before, const netbox::Configuration& after, bool biased) {
  const netbox::Changes changes = netbox::compare(before, after);
  return biased ? changes & ~static_cast<netbox::Changes>(netbox::Change::gage_bias) : changes;
}

std::optional<results::StreamEvent> configuration_event(const netbox::Configuration& before, bool biased,
                                                        const std::function<std::string()>& page,
                                                        const std::function<Instant()>& now, int attempts) {
  results::StreamEvent failure;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    EventKind kind = EventKind::unreachable;
    try {
      const std::string xml = page();
      kind = EventKind::unusable;
      const netbox::Changes changes = changes_since(before, netbox::parse_configuration(xml), biased);
      if (changes == 0) return std::nullopt;
      return event_of(EventKind::configuration_changed, now(),
                      "configuration changed since the run began: " + netbox::to_words(changes) +
                          "; all steps of this run are flagged");
    } catch (const DeviceError& error) {
      failure = event_of(kind, now(), std::string("configuration not verified after the run: ") + error.what());
    }
  }
  return failure;
}

}  // namespace kphi::daq
