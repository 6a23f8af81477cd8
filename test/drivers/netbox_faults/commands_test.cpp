// The latch of the monitor conditions, which another client resets.
#include <gtest/gtest.h>

#include "drivers/netbox/wire/status.hpp"
#include "test/drivers/netbox_faults/joined.hpp"

namespace kphi::netbox::test {
namespace {

using namespace std::chrono_literals;

/// A session on a simulated box, without faults; one thread, virtual time.
struct Wired {
  Wired(const sim::NetBoxSettings& settings, const StreamSettings& stream)
      : box(settings), wire(box, {}, 1), session(stream) {
    session.start(Instant{0});
  }
  void run(int ticks, double fz_n = 0) {
    for (int i = 0; i < ticks; ++i) {
      const Instant now(++tick * 1'000'000 / 7);
      wire.sample({now, {0, 0, fz_n, 0, 0, 0}});
      sim::Datagram datagram;
      while (wire.next_datagram(datagram, now)) session.receive(datagram.payload(), now, out);
      if (session.deadline() <= now) session.advance(now);
      std::array<std::uint8_t, 8> request;
      while (session.next_request(request)) wire.request(request, 7, now);
    }
  }
  std::uint32_t newest_status() const { return out.empty() ? ~0u : out.back().record.status; }

  sim::NetBoxDevice box;
  sim::FaultInjector wire;
  Session session;
  std::vector<StampedRecord> out;
  std::int64_t tick = 0;
};

TEST(MonitorConditions, AShortPeakBetweenTwoRecordsStaysKnownUntilTheLatchIsReset) {
  sim::NetBoxSettings box;
  box.rate_hz = 10;
  box.records_per_datagram = 1;
  box.monitoring = true;
  box.conditions[3].enabled = true;
  box.conditions[3].axis = 2;
  box.conditions[3].counts = 30'000'000;  // Fz > 30 N
  StreamSettings stream;
  stream.records_per_datagram = 1;
  stream.divisor = 700;
  Wired wired(box, stream);
  wired.run(7000);
  EXPECT_EQ(wired.newest_status(), 0u);
  wired.run(7, 40);
  wired.run(1400);
  EXPECT_EQ(wired.newest_status(), 0x80010000u);
  EXPECT_TRUE(has(wired.newest_status(), StatusBit::monitor_condition));
  EXPECT_LT(wired.out.back().record.counts[2], 1'000'000) << "the records themselves have not seen it";
  wired.wire.request(encode_request(Command::reset_latch), 8, Instant(wired.tick * 1'000'000 / 7));
  wired.run(1400);
  EXPECT_EQ(wired.newest_status(), 0u);
}

}  // namespace
}  // namespace kphi::netbox::test
