#include "daq/event_doubts.hpp"

#include <limits>
#include <optional>

namespace kphi::daq {
namespace {

using results::Doubt;
using results::EventKind;
using results::Nanoseconds;
using results::StreamEvent;

constexpr Nanoseconds kForEver = std::numeric_limits<Nanoseconds>::max();

struct Meaning {
  EventKind kind;
  Doubt doubt;
  std::optional<EventKind> until;  ///< nothing: an instant; itself: to the end of the run
};

constexpr Meaning kMeanings[] = {
    {EventKind::restarted, Doubt::stream_restarted, std::nullopt},
    {EventKind::stalled, Doubt::stalled, EventKind::stall_ended},
    {EventKind::silent, Doubt::silent, EventKind::resumed},
    {EventKind::box_trouble, Doubt::box_trouble, std::nullopt},
    {EventKind::stolen, Doubt::stolen, EventKind::resumed},
    {EventKind::unusable, Doubt::configuration_changed, EventKind::configuration_changed},
    {EventKind::configuration_changed, Doubt::configuration_changed, EventKind::configuration_changed},
    {EventKind::motor_reset, Doubt::motor_reset, std::nullopt},
    {EventKind::motor_connected, Doubt::motor_lost, std::nullopt},
    {EventKind::motor_no_answer, Doubt::motor_lost, EventKind::motor_connected},
    {EventKind::motor_silent, Doubt::motor_lost, EventKind::motor_connected},
    {EventKind::motor_coast_denied, Doubt::motor_lost, EventKind::motor_connected},
    {EventKind::motor_lease_expired, Doubt::motor_lost, std::nullopt},
    {EventKind::motor_port_lost, Doubt::motor_lost, EventKind::motor_connected},
    {EventKind::motor_another_module, Doubt::motor_lost, EventKind::motor_connected},
    {EventKind::motor_slow_round_trip, Doubt::slow_round_trip, EventKind::motor_slow_round_trip},
};

Nanoseconds end_of(const Meaning& meaning, std::span<const StreamEvent> later, Nanoseconds begin) {
  if (!meaning.until) return begin;
  for (const StreamEvent& event : later) {
    if (event.kind == *meaning.until) return event.time_ns;
  }
  return kForEver;
}

}  // namespace

std::vector<DoubtSpan> doubt_spans(std::span<const StreamEvent> events) {
  std::vector<DoubtSpan> spans;
  for (std::size_t i = 0; i < events.size(); ++i) {
    for (const Meaning& meaning : kMeanings) {
      if (meaning.kind != events[i].kind) continue;
      const Nanoseconds begin = events[i].time_ns;
      spans.push_back({begin, end_of(meaning, events.subspan(i + 1), begin), meaning.doubt});
    }
  }
  return spans;
}

std::uint32_t doubts_within(std::span<const DoubtSpan> spans, Nanoseconds begin, Nanoseconds end) {
  std::uint32_t bits = 0;
  for (const DoubtSpan& span : spans) {
    if (span.begin < end && span.end >= begin) bits |= static_cast<std::uint32_t>(span.doubt);
  }
  return bits;
}

std::vector<Nanoseconds> stall_ends(std::span<const StreamEvent> events) {
  std::vector<Nanoseconds> times;
  for (const StreamEvent& event : events) {
    if (event.kind == EventKind::stall_ended) times.push_back(event.time_ns);
  }
  return times;
}

}  // namespace kphi::daq
