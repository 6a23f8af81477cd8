// A stream that is leased: it ends by itself when the host dies, and goes on without a doubt while it lives.
#include <gtest/gtest.h>

#include <optional>

#include "drivers/sim/netbox/faults.hpp"
#include "test/drivers/netbox_faults/joined.hpp"

namespace kphi::netbox::test {
namespace {

using namespace std::chrono_literals;
using sim::NetBoxQuirks;

struct Mode {
  const char* name;
  bool buffered;
  int records, divisor;
  NetBoxQuirks::LastBlock last_block;
};

class Lease : public testing::TestWithParam<Mode> {
 protected:
  Joined& join(sim::FaultScript faults = {}) {
    Manner manner{.buffered = GetParam().buffered,
                  .records_per_datagram = GetParam().records,
                  .divisor = GetParam().divisor,
                  .start_again_when_silent = false,
                  .quirks = {},
                  .lease = 2200ms};
    manner.quirks.last_block = GetParam().last_block;
    return joined.emplace(manner, std::move(faults), 7);
  }
  std::optional<Joined> joined;
};

TEST_P(Lease, IsRenewedWithoutLossAndWithoutADoubt) {
  Joined& j = join();
  j.run_until(12s);
  j.finish();
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_GE(j.counters().renewals, 10u);
  EXPECT_EQ(j.counters().restarts, 0u);
  EXPECT_EQ(j.counters().lost_network, 0u) << "in virtual time a renewal reaches the box before its next sample";
  EXPECT_EQ(j.counters().lost_at_renewals, 0u);
  EXPECT_TRUE(j.session().take_events().empty());
}

TEST_P(Lease, EndsByItselfWhenTheHostDies) {
  Joined& j = join();
  j.run_until(3s);
  ASSERT_TRUE(j.box().streaming());
  j.run_box_alone_until(5200ms);
  EXPECT_FALSE(j.box().streaming());
}

TEST_P(Lease, OfAHostThatStoodStillIsTakenAnewAndTheAccountCloses) {
  Joined& j = join();
  j.run_until(3s);
  j.run_box_alone_until(10s);
  j.run_until(15s);
  j.finish();
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_EQ(j.session().state(), State::streaming);
  EXPECT_GT(j.counters().lost_network, 5u * 7000 / static_cast<unsigned>(GetParam().divisor));
  EXPECT_EQ(j.counters().lost_at_renewals, j.counters().lost_network);
  EXPECT_EQ(j.counters().restarts, 0u);
}

TEST_P(Lease, ALostRenewalIsRepeatedInTime) {
  const sim::FaultEntry lost{{"kind", "lost_start"}, {"at_s", "1"}, {"count", "2"}};
  Joined& j = join({sim::fault_of(lost)});
  j.run_until(5s);
  j.finish();
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_EQ(j.counters().lost_network, 0u);
  EXPECT_EQ(j.counters().restarts, 0u);
  EXPECT_GT(j.counters().renewals, 0u);
}

TEST_P(Lease, RenewalsThatAreAllLostEndTheStreamAndItIsTakenAnew) {
  const sim::FaultEntry lost{{"kind", "lost_start"}, {"at_s", "1"}, {"for_s", "2.5"}};
  Joined& j = join({sim::fault_of(lost)});
  j.run_until(8s);
  j.finish();
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_EQ(j.session().state(), State::streaming);
  EXPECT_GT(j.counters().lost_network, 0u);
  EXPECT_EQ(j.counters().reconnects, 1u);
}

TEST_P(Lease, ThatNobodyGrantsAnyMoreIsASilence) {
  const sim::FaultEntry lost{{"kind", "lost_start"}, {"at_s", "1"}, {"for_s", "60"}};
  Joined& j = join({sim::fault_of(lost)});
  j.run_until(10s);
  EXPECT_EQ(j.session().state(), State::silent);
  const std::vector<Event> events = j.session().take_events();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::silent);
}

TEST_P(Lease, AccountsForLossAroundItsRenewals) {
  const sim::FaultEntry loss{{"kind", "loss"}, {"at_s", "0.2"}, {"for_s", "5"}, {"p", "0.1"}};
  Joined& j = join({sim::fault_of(loss)});
  j.run_until(6s);
  j.finish();
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_EQ(j.counters().restarts, 0u);
  EXPECT_LE(j.counters().lost_at_renewals, j.counters().lost_network);
}

TEST_P(Lease, ARestartThatNobodyAskedForIsStillADoubt) {
  const sim::FaultEntry restart{{"kind", "restart"}, {"at_s", "2.3"}};
  Joined& j = join({sim::fault_of(restart)});
  j.run_until(5s);
  j.finish();
  EXPECT_EQ(j.counters().restarts, 1u);
  const std::vector<Event> events = j.session().take_events();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::restarted);
}

TEST_P(Lease, AStreamTakenOverIsNotFoughtForByRenewals) {
  const sim::FaultEntry taken_over{{"kind", "taken_over"}, {"at_s", "2.2"}};
  Joined& j = join({sim::fault_of(taken_over)});
  j.run_until(2200ms);
  const std::uint64_t starts = j.wire().truth().starts;
  j.run_until(12s);
  EXPECT_EQ(j.session().state(), State::silent);
  EXPECT_LE(j.wire().truth().starts, starts + 1);  // the other client's own
}

INSTANTIATE_TEST_SUITE_P(
    , Lease,
    testing::Values(Mode{"Buffered40LastBlockPartial", true, 40, 1, NetBoxQuirks::LastBlock::partial},
                    Mode{"Buffered40LastBlockPadded", true, 40, 1, NetBoxQuirks::LastBlock::padded},
                    Mode{"Buffered40LastBlockDropped", true, 40, 1, NetBoxQuirks::LastBlock::dropped},
                    Mode{"Buffered7At1000LastBlockDropped", true, 7, 7, NetBoxQuirks::LastBlock::dropped},
                    Mode{"RealTimeAt7000", false, 1, 1, NetBoxQuirks::LastBlock::partial}),
    [](const auto& mode) { return std::string(mode.param.name); });

TEST(LeaseSize, IsWholeDatagramsAndLongEnoughToNoticeASilence) {
  StreamSettings settings;
  EXPECT_EQ(settings.sample_count(), 0u);
  settings.lease = 10s;
  EXPECT_EQ(settings.sample_count(), 70'000u);
  settings.records_per_datagram = 33;
  EXPECT_EQ(settings.sample_count() % 33, 0u);
  EXPECT_NEAR(settings.sample_count(), 70'000, 33);
  settings.divisor = 7000;
  EXPECT_EQ(settings.sample_count(), 13u * 33);  // 4 (0.5 s + 3 datagrams of 33 s)
  settings.buffered = false;
  EXPECT_EQ(settings.sample_count(), 14u);
}

}  // namespace
}  // namespace kphi::netbox::test
