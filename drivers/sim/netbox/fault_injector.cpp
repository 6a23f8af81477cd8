// The way of the datagrams. What the script does to the box itself: fault_injector_box.cpp.
#include "drivers/sim/netbox/fault_injector.hpp"

#include <algorithm>
#include <boost/endian/conversion.hpp>
#include <cmath>

namespace kphi::sim {
namespace {

bool on_datagrams(FaultKind kind) noexcept { return within(kind, FaultKind::loss, FaultKind::foreign_source); }
bool on_box(FaultKind kind) noexcept { return within(kind, FaultKind::taken_over, FaultKind::address); }

std::uint32_t word(const Datagram& datagram, std::size_t offset) noexcept {
  return boost::endian::load_big_u32(datagram.bytes.data() + offset);
}

}  // namespace

FaultInjector::FaultInjector(NetBoxDevice& box, FaultScript script, std::uint64_t seed, Keep keep)
    : box_(box),
      script_(std::move(script), seed),
      keep_(keep),
      progress_(script_.size()),
      first_address_(box.settings().address) {
  for (std::size_t i = 0; i < script_.size(); ++i) {
    const Fault& fault = script_[i];
    if (!on_box(fault.kind)) continue;
    script_.plan(i);
    if (fault.kind == FaultKind::reboot) script_.plan({fault.at + fault.down, i, false});
  }
  schedule();
}

bool FaultInjector::next_datagram(Datagram& out, Instant now) {
  carry_all(now);
  if (under_way_.empty() || under_way_.begin()->first > now) return false;
  const auto& [due, first] = *under_way_.begin();
  out = first.datagram;
  out.at = due;
  count_arrival(first, due);
  under_way_.erase(under_way_.begin());
  return true;
}

Instant FaultInjector::next_arrival() const noexcept {
  Instant next = under_way_.empty() ? kNever : under_way_.begin()->first;
  for (const Held& held : held_) next = std::min(next, held.give_up);
  return next;
}

void FaultInjector::carry_all(Instant now) {
  for (InFlightDatagram sent; box_.next_datagram(sent.datagram);) {
    if (sent.datagram.peer != kHijacker) shorten(sent.datagram);
    sent.entry = enter(sent.datagram);
    if (sent.datagram.peer != kHijacker) carry(sent);
  }
  give_up_holding(now);
}

void FaultInjector::shorten(Datagram& datagram) {
  for (std::size_t i = 0; i < script_.size(); ++i) {
    const Fault& fault = script_[i];
    if (fault.kind != FaultKind::short_block || !script_.active(i, datagram.at) || !script_.chance(fault.p)) continue;
    const std::size_t records = datagram.size / kRecordBytes;
    const std::size_t left_out = std::min(static_cast<std::size_t>(fault.records), records - 1);
    datagram.size -= left_out * kRecordBytes;
    truth_.records_left_out += left_out;
    script_.use(i);
  }
}

void FaultInjector::make_up(const InFlightDatagram& after, std::size_t size, bool foreign, Instant due) {
  InFlightDatagram made = after;
  Datagram& datagram = made.datagram;
  made.whole = false;
  if (size > datagram.size) std::fill_n(datagram.bytes.data() + datagram.size, size - datagram.size, std::uint8_t{0});
  datagram.size = size;
  datagram.foreign = foreign;
  if (foreign) boost::endian::store_big_u32(datagram.bytes.data(), word(datagram, 0) + 1000);
  under_way_.emplace(due, made);
}

void FaultInjector::carry(const InFlightDatagram& in_flight) {
  const Instant sent = in_flight.datagram.at;
  give_up_holding(sent);
  const FaultDecision decision = decide(sent);
  last_due_ = decision.due;
  for (std::uint64_t i = 0; i < decision.foreign; ++i) make_up(in_flight, in_flight.datagram.size, true, decision.due);
  for (const std::uint64_t size : decision.sizes)
    make_up(in_flight, static_cast<std::size_t>(size), false, decision.due);
  if (decision.dropped || decision.replaced) {
    ++truth_.dropped;
    truth_.records_dropped += in_flight.datagram.size / kRecordBytes;
    return;
  }
  for (const Duration after : decision.copies) {
    InFlightDatagram copy = in_flight;
    copy.copy = true;
    under_way_.emplace(decision.due + after, copy);
  }
  if (decision.depth > 0) {
    held_.push_back({in_flight, decision.depth, std::max(decision.due, sent + decision.overtaken_for)});
    return;
  }
  under_way_.emplace(decision.due, in_flight);
  let_pass(decision.due);
}

FaultInjector::FaultDecision FaultInjector::decide(Instant at) {
  FaultDecision decision;
  decision.due = at;
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (on_datagrams(script_[i].kind) && script_.active(i, at) && act(script_[i], progress_[i], at, decision))
      script_.use(i);
  }
  if (decision.due > at) ++truth_.delayed;
  decision.due = std::max(decision.due, last_due_);
  return decision;
}

bool FaultInjector::act(const Fault& fault, Progress& progress, Instant at, FaultDecision& decision) {
  using K = FaultKind;
  const auto late = [&](Instant due) { decision.due = std::max(decision.due, due); };
  if (fault.is(K::short_block)) return false;
  if (fault.is(K::loss)) {
    if (progress.burst_left == 0 && script_.chance(fault.p)) progress.burst_left = fault.burst;
    if (progress.burst_left == 0) return false;
    --progress.burst_left;
    decision.dropped = true;
  } else if (fault.is(K::gilbert)) {
    if (script_.chance(progress.bad ? fault.p_bad_good : fault.p_good_bad)) progress.bad = !progress.bad;
    if (!progress.bad || !script_.chance(fault.loss)) return false;
    decision.dropped = true;
  } else if (fault.is(K::delay)) {
    late(at + fault.delay + from_seconds(to_seconds(fault.jitter) * script_.uniform()));
  } else if (fault.is(K::jitter)) {
    const double mean_times = -std::log(script_.uniform() + 0x1p-54);
    const double spike = script_.chance(fault.p) ? script_.uniform() : 0;
    late(at + from_seconds(mean_times * to_seconds(fault.jitter) + spike * to_seconds(fault.spike)));
  } else if (fault.is(K::hold)) {
    late(fault.end());
  } else {
    if (!script_.chance(fault.p)) return false;
    if (fault.is(K::duplicate)) decision.copies.push_back(fault.delay);
    if (fault.is(K::foreign_source)) ++decision.foreign;
    if (fault.is(K::reorder)) {
      decision.depth = std::max(decision.depth, fault.depth);
      decision.overtaken_for = std::max(decision.overtaken_for, fault.delay);
    }
    if (fault.is(K::wrong_size)) {
      decision.sizes.push_back(fault.size);
      decision.replaced = decision.replaced || fault.replaces;
    }
  }
  return true;
}

void FaultInjector::let_pass(Instant due) {
  std::erase_if(held_, [&](Held& held) {
    if (--held.to_pass > 0) return false;
    ++truth_.overtaken;
    under_way_.emplace(due, held.in_flight);
    return true;
  });
}

void FaultInjector::give_up_holding(Instant now) {
  std::erase_if(held_, [&](const Held& held) {
    if (held.give_up > now) return false;
    under_way_.emplace(held.give_up, held.in_flight);
    return true;
  });
}

std::size_t FaultInjector::enter(const Datagram& datagram) {
  const std::size_t records = datagram.size / kRecordBytes;
  if (datagram.peer == kHijacker) {
    ++truth_.to_others;
    truth_.records_to_others += records;
    return 0;
  }
  ++truth_.sent;
  truth_.records_sent += records;
  if (keep_ == Keep::totals) return 0;
  SentDatagram entry;
  entry.boot = datagram.boot;
  entry.stream = datagram.stream;
  entry.first_rdt = word(datagram, 0);
  entry.first_ft = word(datagram, 4);
  entry.last_ft = word(datagram, datagram.size - kRecordBytes + 4);
  entry.records = static_cast<std::uint32_t>(records);
  entry.samples = 1;
  for (std::size_t at = kRecordBytes; at < datagram.size; at += kRecordBytes) {
    if (word(datagram, at + 4) != word(datagram, at + 4 - kRecordBytes)) ++entry.samples;
  }
  entry.sent = datagram.at;
  entry.first_sample = truth_.sampled.size();
  if (keep_ == Keep::samples) {
    truth_.sampled.insert(truth_.sampled.end(), datagram.sampled.begin(),
                          datagram.sampled.begin() + static_cast<std::ptrdiff_t>(records));
    for (std::size_t at = 4; at < datagram.size; at += kRecordBytes) truth_.ft.push_back(word(datagram, at));
  }
  truth_.log.push_back(entry);
  return truth_.log.size() - 1;
}

void FaultInjector::count_arrival(const InFlightDatagram& in_flight, Instant at) {
  if (!in_flight.whole) {
    ++(in_flight.datagram.foreign ? truth_.foreign : truth_.malformed);
    return;
  }
  const std::uint64_t records = in_flight.datagram.size / kRecordBytes;
  if (keep_ != Keep::totals) {
    SentDatagram& entry = truth_.log[in_flight.entry];
    if (entry.arrivals++ == 0) entry.first_arrival = at;
  }
  ++truth_.arrived;
  truth_.records_arrived += records;
  if (in_flight.copy) {
    ++truth_.duplicated;
    truth_.records_duplicated += records;
  }
}

}  // namespace kphi::sim
