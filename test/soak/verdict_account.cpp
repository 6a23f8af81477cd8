#include <fmt/format.h>

#include <algorithm>

#include "drivers/netbox/stream/session.hpp"
#include "test/soak/verdict_checks.hpp"

namespace kphi::soak {
namespace {

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

}  // namespace

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

}  // namespace kphi::soak
