// Decode, and decode + account + session, per record. Goal: the deterministic bench pushes a campaign's 8.4 million
// records through in well under two seconds.
#include <benchmark/benchmark.h>

#include <vector>

#include "drivers/netbox/session.hpp"
#include "test/drivers/netbox/record_bytes.hpp"

namespace {

using namespace kphi;
using namespace kphi::netbox;

void decode_datagram(benchmark::State& state) {
  const auto count = static_cast<unsigned>(state.range(0));
  const test::Bytes datagram = test::records(1, 1, count);
  std::array<Record, kMaxRecords> out;
  for (auto _ : state) {
    benchmark::DoNotOptimize(decode(datagram, out));
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * count);
}
BENCHMARK(decode_datagram)->Arg(1)->Arg(40);

void session_receive(benchmark::State& state) {
  const auto count = static_cast<unsigned>(state.range(0));
  constexpr unsigned kDatagrams = 1000;
  std::vector<test::Bytes> datagrams;
  for (unsigned i = 0; i < kDatagrams; ++i) datagrams.push_back(test::records(1 + i * count, 1 + i * count, count));
  std::vector<StampedRecord> accepted;
  accepted.reserve(kMaxRecords);
  for (auto _ : state) {
    Session session{StreamSettings{}};
    Instant now{0};
    session.start(now);
    session.advance(now = session.deadline());
    for (const test::Bytes& datagram : datagrams) {
      accepted.clear();
      session.receive(datagram, now, accepted);
      benchmark::DoNotOptimize(accepted.data());
    }
    if (session.counters().received != kDatagrams * count) state.SkipWithError("records were lost");
  }
  state.SetItemsProcessed(state.iterations() * kDatagrams * count);
}
BENCHMARK(session_receive)->Arg(1)->Arg(40);

}  // namespace
