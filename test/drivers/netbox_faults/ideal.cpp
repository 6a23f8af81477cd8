#include "test/drivers/netbox_faults/ideal.hpp"

#include <algorithm>
#include <map>
#include <tuple>

namespace kphi::netbox::test {
namespace {

struct Seen {
  std::uint64_t times = 0;
  Instant first{0};
  bool late = false;
};
using SeenDatagrams = std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, Seen>;

struct Last {
  bool any = false;
  std::uint32_t boot = 0, stream = 0, rdt = 0, ft = 0;
};

SeenDatagrams seen_of(std::span<const Arrival> arrivals, Duration patience) {
  SeenDatagrams seen;
  for (const Arrival& arrival : arrivals) {
    Seen& s = seen[{arrival.boot, arrival.stream, arrival.first_rdt}];
    if (s.times++ == 0) s.first = arrival.at;
  }
  Instant younger = kNever;
  for (auto s = seen.rbegin(); s != seen.rend(); ++s) {
    s->second.late = younger != kNever && s->second.first >= younger + patience;
    younger = std::min(younger, s->second.first);
  }
  return seen;
}

void take_into(Ideal& ideal, Last& last, const Ideal::Delivered& record, const sim::SentDatagram& sent,
               std::uint32_t stride) {
  const std::uint32_t advance = record.ft - last.ft;
  const bool anew = !last.any || sent.boot != last.boot || static_cast<std::int32_t>(advance) < 0;
  if (!anew && advance == 0) {
    ++ideal.stalled;
    last.rdt = record.rdt;
    return;
  }
  if (last.any && anew) ++ideal.reboots;
  if (!anew && sent.stream != last.stream) ++ideal.restarts;
  if (!anew && sent.stream == last.stream && (record.rdt - last.rdt) * stride != advance) ++ideal.irregular;
  if (!anew) ideal.lost += std::max<std::uint32_t>(1, (advance + stride / 2) / stride) - 1;
  ++ideal.received;
  ideal.delivered.push_back(record);
  last = {true, sent.boot, sent.stream, record.rdt, record.ft};
}

}  // namespace

Ideal ideal_of(const sim::WireTruth& truth, std::span<const Arrival> arrivals, std::uint32_t stride,
               Duration patience) {
  const SeenDatagrams seen = seen_of(arrivals, patience);
  Ideal ideal;
  Last last;
  for (const sim::SentDatagram& sent : truth.log) {
    const auto found = seen.find({sent.boot, sent.stream, sent.first_rdt});
    if (found == seen.end()) continue;
    if (found->second.late) {
      ideal.late += found->second.times * sent.records;
      continue;
    }
    ideal.duplicates += (found->second.times - 1) * sent.records;
    for (std::uint32_t i = 0; i < sent.records; ++i)
      take_into(ideal, last, {sent.first_rdt + i, truth.ft[sent.first_sample + i], found->second.first}, sent, stride);
  }
  return ideal;
}

std::uint32_t first_rdt(std::span<const std::uint8_t> datagram) {
  return static_cast<std::uint32_t>(datagram[0]) << 24 | static_cast<std::uint32_t>(datagram[1]) << 16 |
         static_cast<std::uint32_t>(datagram[2]) << 8 | datagram[3];
}

}  // namespace kphi::netbox::test
