// The way of the datagrams. What the script does to the box itself: wire_events.cpp.
#include "drivers/sim/wire.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/sim/bytes.hpp"

namespace kphi::sim {
namespace {

std::uint32_t word(const Datagram& datagram, std::size_t offset) noexcept {
  return big(datagram.payload().subspan(offset, 4));
}

}  // namespace

FaultyWire::FaultyWire(NetBoxDevice& box, FaultScript script, std::uint64_t seed, Keep keep)
    : box_(box),
      script_(std::move(script)),
      random_(seed),
      keep_(keep),
      progress_(script_.size()),
      first_address_(box.settings().address) {
  for (std::size_t i = 0; i < script_.size(); ++i) {
    const Fault& fault = script_[i];
    direct_ = direct_ && !on_datagrams(fault.kind);
    if (!on_box(fault.kind)) continue;
    events_.push_back({fault.at, i, true});
    if (fault.kind == FaultKind::reboot) events_.push_back({fault.at + fault.down, i, false});
    if (fault.end() != kNever) events_.push_back({fault.end(), i, false});
  }
  // A beginning before an end at the same time, or a fault without duration would never end.
  std::stable_sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) { return a.at < b.at; });
  std::reverse(events_.begin(), events_.end());
  schedule();
}

bool FaultyWire::active(std::size_t fault, Instant at) const noexcept {
  const Fault& f = script_[fault];
  return at >= f.at && at < f.end() && (f.count == 0 || progress_[fault].used < f.count);
}

bool FaultyWire::next_datagram(Datagram& out, Instant now) {
  if (direct_) {
    while (box_.next_datagram(out)) {
      const std::size_t entry = enter(out);
      if (out.peer == kThief) continue;
      if (keep_ == Keep::totals) {
        ++truth_.arrived;
        truth_.records_arrived += out.size / kRecordBytes;
      } else {
        passing_.entry = entry;
        passing_.datagram.size = out.size;
        count_arrival(passing_, out.at);
      }
      return true;
    }
    return false;
  }
  carry_all(now);
  const Instant due = under_way_.next();
  if (due > now || due == kNever) return false;
  const Parcel& first = under_way_.first();
  out = first.datagram;
  out.at = due;
  count_arrival(first, due);
  under_way_.drop_first();
  return true;
}

Instant FaultyWire::next_arrival() const noexcept {
  Instant next = under_way_.next();
  for (const Held& held : held_) next = std::min(next, held.give_up);
  return next;
}

void FaultyWire::carry_all(Instant now) {
  while (box_.next_datagram(passing_.datagram)) {
    if (passing_.datagram.peer != kThief) shorten(passing_.datagram);
    passing_.entry = enter(passing_.datagram);
    if (passing_.datagram.peer != kThief) carry(passing_);
  }
  give_up_holding(now);
}

void FaultyWire::shorten(Datagram& datagram) {
  for (std::size_t i = 0; i < script_.size(); ++i) {
    const Fault& fault = script_[i];
    if (fault.kind != FaultKind::short_block || !active(i, datagram.at) || !chance(fault.p)) continue;
    const std::size_t records = datagram.size / kRecordBytes;
    const std::size_t left_out = std::min(static_cast<std::size_t>(fault.records), records - 1);
    datagram.size -= left_out * kRecordBytes;
    truth_.records_left_out += left_out;
    ++progress_[i].used;
  }
}

void FaultyWire::make_up(const Parcel& after, std::size_t size, bool foreign, Instant due) {
  Parcel made = after;
  Datagram& datagram = made.datagram;
  made.whole = false;
  if (size > datagram.size) std::fill_n(datagram.bytes.data() + datagram.size, size - datagram.size, std::uint8_t{0});
  datagram.size = size;
  datagram.foreign = foreign;
  if (foreign) put_big(datagram.bytes.data(), word(datagram, 0) + 1000);
  under_way_.add(made, due);
}

void FaultyWire::carry(const Parcel& parcel) {
  const Instant sent = parcel.datagram.at;
  give_up_holding(sent);
  const Fate fate = decide(sent);
  last_due_ = fate.due;
  for (std::uint64_t i = 0; i < fate.foreign; ++i) make_up(parcel, parcel.datagram.size, true, fate.due);
  for (const std::uint64_t size : fate.sizes) make_up(parcel, static_cast<std::size_t>(size), false, fate.due);
  if (fate.dropped || fate.replaced) {
    ++truth_.dropped;
    truth_.records_dropped += parcel.datagram.size / kRecordBytes;
    return;
  }
  for (const Duration after : fate.copies) {
    Parcel copy = parcel;
    copy.copy = true;
    under_way_.add(copy, fate.due + after);
  }
  if (fate.depth > 0) {
    held_.push_back({parcel, fate.depth, std::max(fate.due, sent + fate.overtaken_for)});
    return;
  }
  under_way_.add(parcel, fate.due);
  let_pass(fate.due);
}

FaultyWire::Fate FaultyWire::decide(Instant at) {
  Fate fate;
  fate.due = at;
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (on_datagrams(script_[i].kind) && active(i, at)) act(script_[i], progress_[i], at, fate);
  }
  if (fate.due > at) ++truth_.delayed;
  fate.due = std::max(fate.due, last_due_);
  return fate;
}

void FaultyWire::act(const Fault& fault, Progress& progress, Instant at, Fate& fate) {
  switch (fault.kind) {
    case FaultKind::loss:
      if (progress.burst_left == 0 && chance(fault.p)) progress.burst_left = fault.burst;
      if (progress.burst_left == 0) return;
      --progress.burst_left;
      fate.dropped = true;
      break;
    case FaultKind::gilbert:
      if (chance(progress.bad ? fault.p_bad_good : fault.p_good_bad)) progress.bad = !progress.bad;
      if (!progress.bad || !chance(fault.loss)) return;
      fate.dropped = true;
      break;
    case FaultKind::delay:
      fate.due = std::max(fate.due,
                          at + fault.delay + from_seconds(to_seconds(fault.jitter) * 0.5 * (random_.symmetric() + 1)));
      break;
    case FaultKind::jitter: {
      const double mean_times = -std::log(0.5 * (random_.symmetric() + 1) + 0x1p-54);
      const double spike = chance(fault.p) ? 0.5 * (random_.symmetric() + 1) : 0;
      fate.due = std::max(fate.due,
                          at + from_seconds(mean_times * to_seconds(fault.jitter) + spike * to_seconds(fault.spike)));
      break;
    }
    case FaultKind::short_block:
      return;
    case FaultKind::hold:
      fate.due = std::max(fate.due, fault.end());
      break;
    default:
      if (!chance(fault.p)) return;
      if (fault.kind == FaultKind::duplicate) fate.copies.push_back(fault.delay);
      if (fault.kind == FaultKind::foreign_source) ++fate.foreign;
      if (fault.kind == FaultKind::reorder) {
        fate.depth = std::max(fate.depth, fault.depth);
        fate.overtaken_for = std::max(fate.overtaken_for, fault.delay);
      }
      if (fault.kind == FaultKind::wrong_size) {
        fate.sizes.push_back(fault.size);
        fate.replaced = fate.replaced || fault.replaces;
      }
  }
  ++progress.used;
}

void FaultyWire::let_pass(Instant due) {
  for (std::size_t i = 0; i < held_.size();) {
    if (--held_[i].to_pass > 0) {
      ++i;
      continue;
    }
    ++truth_.overtaken;
    under_way_.add(held_[i].parcel, due);
    held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void FaultyWire::give_up_holding(Instant now) {
  for (std::size_t i = 0; i < held_.size();) {
    if (held_[i].give_up > now) {
      ++i;
      continue;
    }
    under_way_.add(held_[i].parcel, held_[i].give_up);
    held_.erase(held_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

std::size_t FaultyWire::enter(const Datagram& datagram) {
  const std::size_t records = datagram.size / kRecordBytes;
  if (datagram.peer == kThief) {
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

void FaultyWire::count_arrival(const Parcel& parcel, Instant at) {
  if (!parcel.whole) {
    ++(parcel.datagram.foreign ? truth_.foreign : truth_.malformed);
    return;
  }
  const std::uint64_t records = parcel.datagram.size / kRecordBytes;
  if (keep_ != Keep::totals) {
    SentDatagram& entry = truth_.log[parcel.entry];
    if (entry.arrivals++ == 0) {
      entry.first_arrival = at;
      entry.arrival_place = truth_.arrived;
    }
  }
  ++truth_.arrived;
  truth_.records_arrived += records;
  if (parcel.copy) {
    ++truth_.duplicated;
    truth_.records_duplicated += records;
  }
}

}  // namespace kphi::sim
