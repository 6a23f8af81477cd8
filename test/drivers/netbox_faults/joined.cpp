#include "test/drivers/netbox_faults/joined.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>

namespace kphi::netbox::test {
namespace {

constexpr sim::Peer kHost = 7;
constexpr int kTicksPerSecond = 7000;

sim::NetBoxSettings box_settings(const Manner& manner) {
  sim::NetBoxSettings settings;
  settings.rate_hz = static_cast<double>(kTicksPerSecond) / manner.divisor;
  settings.records_per_datagram = manner.records_per_datagram;
  settings.first_ft_sequence = manner.first_ft;
  settings.habits = manner.habits;
  return settings;
}

StreamSettings stream_settings(const Manner& manner) {
  StreamSettings settings;
  settings.buffered = manner.buffered;
  settings.divisor = static_cast<unsigned>(manner.divisor);
  settings.records_per_datagram = manner.records_per_datagram;
  return settings;
}

/// Big-endian, independent of both sides.
std::uint32_t word(const std::uint8_t* bytes) {
  return static_cast<std::uint32_t>(bytes[0]) << 24 | static_cast<std::uint32_t>(bytes[1]) << 16 |
         static_cast<std::uint32_t>(bytes[2]) << 8 | bytes[3];
}

}  // namespace

Joined::Joined(const Manner& manner, sim::FaultScript script, std::uint64_t seed)
    : manner_(manner),
      box_(box_settings(manner)),
      wire_(box_, std::move(script), seed, sim::FaultyWire::Keep::samples),
      session_(stream_settings(manner)) {
  session_.start(Instant{0});
}

void Joined::run_until(Instant end) {
  for (;;) {
    const Instant at(static_cast<std::int64_t>((tick_ + 1) * 1'000'000 / 7));
    if (at > end) return;
    ++tick_;
    wire_.sample({at, {0, 0, 1e-6 * static_cast<double>(tick_ % 50'000'000), 0, 0, 0}});
    pump(at);
  }
}

void Joined::pump(Instant now) {
  sim::Datagram datagram;
  while (wire_.next_datagram(datagram, now)) {
    if (datagram.foreign) continue;  // a connected socket does not see it
    session_.receive(datagram.payload(), datagram.at, out_);
    const bool whole =
        datagram.size > 0 && datagram.size % kRecordBytes == 0 && datagram.size / kRecordBytes <= kMaxRecords;
    const bool drained = session_.counters().drained > drained_;
    drained_ = session_.counters().drained;
    if (whole && !drained)
      arrivals_.push_back({datagram.boot, datagram.stream, word(datagram.bytes.data()), datagram.at});
  }
  if (session_.release_deadline() <= now) session_.release(now, out_);
  if (session_.deadline() <= now) session_.advance(now);
  if (session_.state() == State::silent && manner_.start_again_when_silent) {
    ++silences_;
    session_.start(now);
  }
  std::array<std::uint8_t, 8> request;
  while (session_.next_request(request)) wire_.request(request, kHost, now);
}

void Joined::finish() { session_.flush(out_); }

Ideal Joined::ideal() const {
  struct Seen {
    std::uint64_t times = 0;
    Instant first{0};
    bool late = false;
  };
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, Seen> seen;
  for (const Arrival& arrival : arrivals_) {
    Seen& s = seen[{arrival.boot, arrival.stream, arrival.first_rdt}];
    if (s.times++ == 0) s.first = arrival.at;
  }
  Instant younger = kNever;
  for (auto s = seen.rbegin(); s != seen.rend(); ++s) {
    s->second.late = younger != kNever && s->second.first >= younger + session_.settings().reorder_patience;
    younger = std::min(younger, s->second.first);
  }
  const auto stride = static_cast<std::uint32_t>(manner_.divisor);
  Ideal ideal;
  ideal.malformed = wire_.truth().malformed;
  const sim::SentDatagram* last = nullptr;
  for (const sim::SentDatagram& sent : wire_.truth().log) {
    const auto found = seen.find({sent.boot, sent.stream, sent.first_rdt});
    if (found == seen.end()) continue;
    const Seen& s = found->second;
    if (s.late) {
      ideal.late += s.times * sent.records;
      continue;
    }
    const bool anew =
        last == nullptr || sent.boot != last->boot || static_cast<std::int32_t>(sent.first_ft - last->last_ft) < 0;
    const bool repeats = !anew && sent.first_ft == last->last_ft;
    const std::uint64_t fresh = sent.samples - (repeats ? 1 : 0);
    ideal.received += fresh;
    ideal.stalled += sent.records - fresh;
    ideal.duplicates += (s.times - 1) * sent.records;
    if (last != nullptr && anew) ++ideal.reboots;
    if (!anew && sent.stream != last->stream) ++ideal.restarts;
    if (!anew && !repeats) {
      ideal.lost += std::max<std::uint32_t>(1, (sent.first_ft - last->last_ft + stride / 2) / stride) - 1;
    }
    for (std::uint32_t i = 0; sent.samples == sent.records && !repeats && i < sent.records; ++i)
      ideal.delivered.push_back({sent.first_rdt + i, sent.first_ft + i * stride, s.first});
    last = &sent;
  }
  return ideal;
}

std::string Joined::disagreement() const {
  const Ideal truth = ideal();
  const Counters& account = session_.counters();
  std::string out;
  const auto compare = [&](const char* what, std::uint64_t driver, std::uint64_t simulator) {
    if (driver != simulator) out += fmt::format("{}: driver {}, truth {}\n", what, driver, simulator);
  };
  compare("received", account.received, truth.received);
  compare("lost", account.lost_network, truth.lost);
  compare("lost in host", account.lost_host, 0);
  compare("duplicates", account.duplicates, truth.duplicates);
  compare("late", account.late, truth.late);
  compare("stalled", account.stalled, truth.stalled);
  compare("restarts", account.restarts, truth.restarts);
  compare("reboots", account.reboots, truth.reboots);
  compare("malformed", account.malformed, truth.malformed);
  compare("sum", account.expected, account.received + account.lost_network + account.lost_host);
  compare("delivered", out_.size(), truth.received);
  if (truth.stalled > 0) return out;  // which of two equal samples was kept is not in the log
  for (std::size_t i = 0; i < std::min(out_.size(), truth.delivered.size()); ++i) {
    const Ideal::Delivered given{out_[i].record.rdt_sequence, out_[i].record.ft_sequence, out_[i].arrival};
    if (given == truth.delivered[i]) continue;
    const auto& t = truth.delivered[i];
    return out + fmt::format("record {}: driver rdt {} ft {} at {}, truth rdt {} ft {} at {}\n", i, given.rdt, given.ft,
                             given.arrival.count(), t.rdt, t.ft, t.arrival.count());
  }
  return out;
}

}  // namespace kphi::netbox::test
