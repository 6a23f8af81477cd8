#include "drivers/netbox/stream/events.hpp"

#include <fmt/format.h>

#include "drivers/netbox/wire/status.hpp"

namespace kphi::netbox {
namespace {

std::string numbers(const Event& event) {
  return fmt::format("(rdt {} after {}, ft {} after {})", event.rdt, event.previous_rdt, event.ft, event.previous_ft);
}

std::string words(const Event& event) {
  switch (event.kind) {
    case EventKind::restarted:
      return fmt::format("the stream restarted {}, {} records missing", numbers(event), event.records);
    case EventKind::rebooted:
      return fmt::format("the box has booted {}: its bias and scale may have changed", numbers(event));
    case EventKind::stalled:
      return fmt::format("the box repeats one measurement {}", numbers(event));
    case EventKind::stall_ended:
      return fmt::format("the box measures again after {} repeated records", event.records);
    case EventKind::silent:
      return "the stream fell silent";
    case EventKind::resumed:
      return fmt::format("the stream continues (rdt {}, ft {})", event.rdt, event.ft);
    case EventKind::box_trouble: {
      std::string bits;
      for (const std::string& name : names(event.status)) bits += (bits.empty() ? "" : ", ") + name;
      return "the box reports: " + bits;
    }
    case EventKind::taken_over:
      return "the box answers and RDT is enabled: another client has taken the stream; "
             "close the other client, then start again";
    case EventKind::rdt_disabled:
      return "RDT is disabled: enable it on the box's Communications page";
    case EventKind::unreachable:
      return "the box does not answer over HTTP: check its power and the cable";
    case EventKind::unusable:
      return "the box answers, but its configuration is unusable: check its web pages";
    case EventKind::reconnected:
      return fmt::format("the stream was started again {}", numbers(event));
    case EventKind::configuration_changed:
      return "the box's configuration has changed: " + to_words(event.changes);
    case EventKind::given_up:
      return "the stream could not be started again: check the box, its cable and its power";
  }
  return "unknown event";
}

}  // namespace

std::string to_string(const Event& event) { return fmt::format("{:.3f} s: {}", to_seconds(event.at), words(event)); }

}  // namespace kphi::netbox
