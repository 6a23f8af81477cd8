#include <fmt/format.h>

#include <algorithm>

#include "drivers/netbox/stream/session.hpp"
#include "test/soak/verdict_checks.hpp"

namespace kphi::soak {
namespace {

using namespace std::chrono_literals;

constexpr Duration kFresh = 250ms;

const Story::Stream* stream_of(const Story& story, const results::RunRecording& run) {
  if (run.phases.empty()) return nullptr;
  const Story::Stream* found = nullptr;
  for (const Story::Stream& stream : story.streams) {
    if (stream.began.count() <= run.phases.front().time_ns) found = &stream;
  }
  return found;
}

bool same(const LoadCellRecord& record, const netbox::test::Ideal::Delivered& true_one) {
  return record.rdt_sequence == true_one.rdt && record.ft_sequence == true_one.ft &&
         record.arrival_ns == true_one.arrival.count();
}

void check_records(const FileOfRun& file, const netbox::test::Ideal& truth, Lines& wrong) {
  const auto& records = file.run.load_cell;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (i < truth.delivered.size() && same(records[i], truth.delivered[i])) continue;
    wrong.push_back(fmt::format("account: {}: record {} of {} (rdt {}, ft {}, arrived {} ns) is not the one in truth",
                                file.name(), i, records.size(), records[i].rdt_sequence, records[i].ft_sequence,
                                records[i].arrival_ns));
    return;
  }
}

void check_numbers(const FileOfRun& file, const Story::Stream& stream, const netbox::test::Ideal& truth, Lines& wrong) {
  const SampleAccount& account = file.run.account;
  const auto compare = [&](const char* what, std::uint64_t counted, std::uint64_t is) {
    if (counted != is)
      wrong.push_back(fmt::format("account: {}: {}: counted {}, in truth {}", file.name(), what, counted, is));
  };
  compare("received", account.received, truth.received);
  compare("records in the file", file.run.load_cell.size(), truth.received);
  const auto& events = file.run.events;
  const bool one_stride =
      std::ranges::find(events, EventKind::configuration_changed, &StreamEvent::kind) == events.end();
  if (one_stride) compare("lost in the network", account.lost_network, truth.lost);
  compare("lost in the host", account.lost_host, 0);
  compare("sum", account.received + account.lost_network + account.lost_host, account.expected);
  if (stream.strays == 0) {
    compare("duplicates", account.duplicates, truth.duplicates);
    compare("late", account.late, truth.late);
  }
  compare("discarded", account.duplicates + account.late, truth.duplicates + truth.late + stream.strays);
  compare("stalled", account.stalled, truth.stalled);
  compare("restarts", account.restarts, truth.restarts);
  compare("reboots", account.reboots, truth.reboots);
  if (one_stride) compare("irregular", account.irregular, truth.irregular);
  if (account.malformed > stream.malformed.size()) compare("malformed", account.malformed, stream.malformed.size());
}

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

void check_absence(const Evidence& evidence, Lines& wrong) {
  if (!evidence.mixture.absence || !evidence.story.comeback) return;
  const Absence& absence = *evidence.mixture.absence;
  const Comeback& seen = *evidence.story.comeback;
  const auto has = [&](EventKind kind) {
    return std::find(seen.events.begin(), seen.events.end(), kind) != seen.events.end();
  };
  const auto unless = [&](bool right, const std::string& what) {
    if (!right) wrong.push_back(fmt::format("absence: {} (\"{}\")", what, seen.failure));
  };
  unless(has(EventKind::silent), "nobody noticed that the stream fell silent");
  if (!absence.returns) {
    unless(seen.starts == 1, fmt::format("{} starts of a stream that another client has taken", seen.starts));
    unless(has(EventKind::taken_over), "the event does not say that the stream was taken over");
    return unless(!seen.failure.empty(), "the stream of another client counts as working");
  }
  unless(seen.newest + kFresh >= seen.ended,
         fmt::format("the box answers from {:.3f} s on, the newest sample of {:.3f} s is from {:.3f} s",
                     to_seconds(absence.ends), to_seconds(seen.ended), to_seconds(seen.newest)));
  unless(seen.failure.empty(), "the stream counts as failed although the box is back");
  // Where kphi need not start it, it may: it asks the box in the moment in which the datagrams come through again.
  unless(has(EventKind::reconnected) || (!absence.is_started && has(EventKind::resumed)),
         "no event says that the stream came back");
}

void check_account(const Evidence& evidence, Lines& wrong) {
  if (evidence.wire == nullptr) return;
  for (const FileOfRun& file : evidence.files) {
    const Story::Stream* stream = file.inherited ? nullptr : stream_of(evidence.story, file.run);
    if (stream == nullptr) continue;
    const auto truth = netbox::test::ideal_of(*evidence.wire, stream->arrivals, file.run.header.load_cell.ft_stride,
                                              netbox::StreamSettings{}.reorder_patience);
    check_records(file, truth, wrong);
    if (file.path.extension() != ".part") check_numbers(file, *stream, truth, wrong);
  }
}

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
