#include "daq/event_doubts.hpp"

#include <limits>

namespace kphi::daq {
namespace {

using results::Doubt;
using results::EventKind;
using results::Nanoseconds;
using results::StreamEvent;

constexpr Nanoseconds kSinceEver = std::numeric_limits<Nanoseconds>::min();
constexpr Nanoseconds kForEver = std::numeric_limits<Nanoseconds>::max();

enum class Concerns : std::uint8_t { instant, until_it_ends, whole_run };

struct Meaning {
  EventKind kind;
  Doubt doubt;
  Concerns concerns;
  EventKind end{};  ///< of what lasts until it ends
};

constexpr Meaning kMeanings[] = {
    {EventKind::restarted, Doubt::stream_restarted, Concerns::instant},
    {EventKind::stalled, Doubt::stalled, Concerns::until_it_ends, EventKind::stall_ended},
    {EventKind::silent, Doubt::silent, Concerns::until_it_ends, EventKind::resumed},
    {EventKind::box_trouble, Doubt::box_trouble, Concerns::instant},
    {EventKind::stolen, Doubt::stolen, Concerns::until_it_ends, EventKind::resumed},
    // The box is read at times; nobody knows when between two readings it was set otherwise.
    {EventKind::unusable, Doubt::configuration_changed, Concerns::whole_run},
    {EventKind::configuration_changed, Doubt::configuration_changed, Concerns::whole_run},
    {EventKind::motor_reset, Doubt::motor_reset, Concerns::instant},
    {EventKind::motor_connected, Doubt::motor_lost, Concerns::instant},
    {EventKind::motor_no_answer, Doubt::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_silent, Doubt::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_coast_denied, Doubt::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_lease_expired, Doubt::motor_lost, Concerns::instant},
    {EventKind::motor_port_lost, Doubt::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_another_module, Doubt::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_host_absent, Doubt::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_let_go, Doubt::motor_lost, Concerns::until_it_ends, EventKind::motor_connected},
    {EventKind::motor_slow_round_trip, Doubt::slow_round_trip, Concerns::until_it_ends,
     EventKind::motor_slow_round_trip},
};

Nanoseconds end_of(const Meaning& meaning, std::span<const StreamEvent> later, Nanoseconds begin) {
  if (meaning.concerns == Concerns::instant) return begin;
  if (meaning.concerns == Concerns::whole_run) return kForEver;
  for (const StreamEvent& event : later) {
    if (event.kind == meaning.end) return event.time_ns;
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
      spans.push_back({meaning.concerns == Concerns::whole_run ? kSinceEver : begin,
                       end_of(meaning, events.subspan(i + 1), begin), meaning.doubt});
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
