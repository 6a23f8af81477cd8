#include "drivers/netbox/stream/events.hpp"

#include <fmt/format.h>

#include "drivers/netbox/wire/status.hpp"

namespace kphi::netbox {
namespace {

constexpr const char* kWords[] = {
    "the stream restarted {numbers}, {records} records missing",
    "the box has booted {numbers}: its bias and scale may have changed",
    "the box repeats one measurement {numbers}",
    "the box measures again after {records} repeated records",
    "the stream fell silent",
    "the stream continues (rdt {rdt}, ft {ft})",
    "the box reports: {bits}",
    "the box answers and RDT is enabled: another client has taken the stream; close the other client, then start again",
    "RDT is disabled: enable it on the box's Communications page",
    "the box does not answer over HTTP: check its power and the cable",
    "",
    "",
    "",  // of the ranges: the recorder's and the guard's
    "the box answers, but its configuration is unusable: check its web pages",
    "the stream was started again {numbers}",
    "the box's configuration has changed: {changes}",
    "the stream could not be started again: check the box, its cable and its power",
};  // by EventKind

}  // namespace

std::string to_string(const Event& event) {
  const std::string numbers =
      fmt::format("(rdt {} after {}, ft {} after {})", event.rdt, event.previous_rdt, event.ft, event.previous_ft);
  const std::string words =
      fmt::format(fmt::runtime(kWords[static_cast<std::size_t>(event.kind)]), fmt::arg("numbers", numbers),
                  fmt::arg("records", event.records), fmt::arg("rdt", event.rdt), fmt::arg("ft", event.ft),
                  fmt::arg("bits", fmt::join(names(event.status), ", ")), fmt::arg("changes", to_words(event.changes)));
  return fmt::format("{:.3f} s: {}", to_seconds(event.at), words);
}

}  // namespace kphi::netbox
