#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "test/soak/verdict_checks.hpp"

namespace kphi::soak {
namespace {

using namespace std::chrono_literals;

constexpr Duration kUnjudged = 20ms;  ///< at the end of a run, when the guard has stood down
/// Of a Net Box: summary, latch, saturation, and what concerns its networks only.
constexpr std::uint32_t kBorne =
    0x80010000u | 1u << 17 | 1u << 18 | 1u << 19 | 1u << 20 | 1u << 21 | 1u << 22 | 1u << 1;

/// When the first sample came that was one too many.
std::optional<Instant> one_too_many(const results::RunRecording& run, int patience) {
  int on_end = 0;
  for (const auto& sample : run.load_cell) {
    on_end = (sample.status & ~kBorne) != 0 ? on_end + 1 : 0;
    if (on_end > patience) return Instant(sample.arrival_ns);
  }
  return std::nullopt;
}

bool was_judged(const results::RunRecording& run, Instant at) {
  return !run.phases.empty() && at < Instant(run.phases.back().time_ns) - kUnjudged;
}

}  // namespace

void check_status(const Evidence& evidence, const Reaches& reaches, Lines& wrong) {
  const Story& story = evidence.story;
  for (const FileOfRun& file : evidence.files) {
    const auto noticed =
        file.inherited ? std::nullopt : one_too_many(file.run, evidence.config.netbox.records_per_datagram);
    if (!noticed) continue;
    if (file.run.outcome == results::Outcome::complete) {
      if (was_judged(file.run, *noticed))
        wrong.push_back(fmt::format("status: {} is complete, though the box reported an error", file.name()));
      continue;
    }
    const bool alone = evidence.killed() || reaches.line_silenced(*noticed - kOwnTimeout, *noticed + kOwnTimeout);
    const Instant limit = *noticed + (alone ? kOwnTimeout : kHeard);
    if (story.stages.empty() || story.stages.back().at <= limit) continue;
    wrong.push_back(
        fmt::format("status: {}: coasts {:.0f} ms after the box reported an error in more samples than a "
                    "datagram holds",
                    file.name(), 1e3 * to_seconds(story.stages.back().at - *noticed)));
  }
}

}  // namespace kphi::soak
