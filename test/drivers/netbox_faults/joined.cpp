#include "test/drivers/netbox_faults/joined.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace kphi::netbox::test {
namespace {

constexpr sim::Peer kHost = 7;
constexpr int kTicksPerSecond = 7000;

sim::NetBoxSettings box_settings(const Manner& manner) {
  sim::NetBoxSettings settings;
  settings.rate_hz = static_cast<double>(kTicksPerSecond) / manner.divisor;
  settings.records_per_datagram = manner.records_per_datagram;
  settings.first_ft_sequence = manner.first_ft;
  settings.quirks = manner.quirks;
  return settings;
}

StreamSettings stream_settings(const Manner& manner) {
  StreamSettings settings;
  settings.divisor = static_cast<unsigned>(manner.divisor);
  settings.records_per_datagram = manner.records_per_datagram;
  settings.product = manner.quirks.axia ? Product::axia : Product::net_box;
  return settings;
}

/// Of 7000 a second; the time of tick `number`.
Instant time_of(std::uint64_t number) { return Instant(static_cast<std::int64_t>(number * 1'000'000 / 7)); }

}  // namespace

Joined::Joined(const Manner& manner, sim::FaultScript script, std::uint64_t seed)
    : manner_(manner),
      box_(box_settings(manner)),
      wire_(box_, std::move(script), seed, sim::FaultInjector::Keep::samples),
      session_(stream_settings(manner)) {
  session_.start(Instant{0});
}

void Joined::run_until(Instant end) {
  while (time_of(tick_ + 1) <= end) pump(sample());
}

void Joined::run_box_alone_until(Instant end) {
  while (time_of(tick_ + 1) <= end) sample();
}

Instant Joined::sample() {
  const Instant at = time_of(++tick_);
  wire_.sample({at, {0, 0, 1e-6 * static_cast<double>(tick_ % 50'000'000), 0, 0, 0}});
  return at;
}

void Joined::pump(Instant now) {
  sim::Datagram datagram;
  while (wire_.next_datagram(datagram, now)) {
    if (datagram.foreign || !wire_.moved_to().empty()) continue;  // a connected socket does not see it
    session_.receive(datagram.payload(), datagram.at, out_);
    const bool whole =
        datagram.size > 0 && datagram.size % kRecordBytes == 0 && datagram.size / kRecordBytes <= kMaxRecords;
    const bool drained = session_.counters().drained > drained_;
    drained_ = session_.counters().drained;
    if (whole && !drained)
      arrivals_.push_back({datagram.boot, datagram.stream, first_rdt(datagram.payload()), datagram.at});
  }
  if (session_.release_deadline() <= now) session_.release(now, out_);
  if (session_.deadline() <= now) session_.advance(now);
  if (session_.state() == State::silent && manner_.start_again_when_silent) {
    ++silences_;
    session_.start(now);
  }
  std::array<std::uint8_t, 8> request;
  while (session_.next_request(request)) {
    if (wire_.moved_to().empty()) wire_.request(request, kHost, now);
  }
}

void Joined::finish() { session_.flush(out_); }

void Joined::agree_until(Instant end) {
  run_until(end);
  finish();
  EXPECT_EQ(disagreement(), "");
}

Ideal Joined::ideal() const {
  return ideal_of(wire_.truth(), arrivals_, static_cast<std::uint32_t>(manner_.divisor),
                  session_.settings().reorder_patience);
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
  compare("irregular", account.irregular, truth.irregular);
  compare("malformed", account.malformed, wire_.truth().malformed);
  compare("sum", account.expected, account.received + account.lost_network + account.lost_host);
  compare("delivered", out_.size(), truth.received);
  for (std::size_t i = 0; i < std::min(out_.size(), truth.delivered.size()); ++i) {
    const Ideal::Delivered given{out_[i].rdt_sequence, out_[i].ft_sequence, out_[i].arrival()};
    if (given == truth.delivered[i]) continue;
    const auto& t = truth.delivered[i];
    return out + fmt::format("record {}: driver rdt {} ft {} at {}, truth rdt {} ft {} at {}\n", i, given.rdt, given.ft,
                             given.arrival.count(), t.rdt, t.ft, t.arrival.count());
  }
  return out;
}

}  // namespace kphi::netbox::test
