// Each fault alone: the driver's account equals the simulator's truth, and what it delivers is what was sent, in order,
// once, each record with the time of its first arrival.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "drivers/sim/script/faults.hpp"
#include "test/drivers/netbox_faults/joined.hpp"

namespace kphi::netbox::test {
namespace each_fault_test {

using namespace std::chrono_literals;
using sim::FaultEntry;

sim::FaultScript script(std::initializer_list<FaultEntry> entries) {
  sim::FaultScript faults;
  for (const FaultEntry& entry : entries) faults.push_back(sim::fault_of(entry));
  return faults;
}

struct Mode {
  const char* name;
  Manner manner;
};

class EachFault : public testing::TestWithParam<Mode> {
 protected:
  /// Runs three seconds and expects agreement.
  Joined& run(sim::FaultScript faults, Instant end = 3s) {
    joined.emplace(GetParam().manner, std::move(faults), 42);
    joined->run_until(end);
    joined->finish();
    EXPECT_EQ(joined->disagreement(), "");
    EXPECT_GT(joined->counters().received, 0u);
    return *joined;
  }
  [[nodiscard]] bool slow() const { return GetParam().manner.divisor > 10; }
  std::optional<Joined> joined;
};

TEST_P(EachFault, NoneAtAll) {
  Joined& j = run({});
  EXPECT_EQ(j.counters().lost_network, 0u);
  EXPECT_EQ(j.counters().duplicates, 0u);
}

TEST_P(EachFault, UniformLoss) {
  const Counters& c = run(script({{{"kind", "loss"}, {"at_s", "0.5"}, {"for_s", "2"}, {"p", "0.1"}}})).counters();
  EXPECT_GT(c.lost_network, 0u);
}

TEST_P(EachFault, BurstLoss) {
  const Counters& c =
      run(script({{{"kind", "loss"}, {"at_s", "0.5"}, {"for_s", "2"}, {"p", "0.05"}, {"burst", "7"}}})).counters();
  EXPECT_GT(c.lost_network, 0u);
}

TEST_P(EachFault, GilbertElliottLoss) {
  run(script({{{"kind", "gilbert"},
               {"at_s", "0.5"},
               {"for_s", "2"},
               {"p_good_bad", "0.05"},
               {"p_bad_good", "0.3"},
               {"loss", "0.8"}}}));
  EXPECT_GT(joined->counters().lost_network, 0u);
}

TEST_P(EachFault, Duplicates) {
  run(script({{{"kind", "duplicate"}, {"at_s", "0.5"}, {"for_s", "2"}, {"p", "0.2"}}}));
  EXPECT_GT(joined->counters().duplicates, 0u);
}

TEST_P(EachFault, DuplicatesMuchLater) {
  run(script({{{"kind", "duplicate"}, {"at_s", "0.5"}, {"for_s", "1"}, {"p", "0.2"}, {"delay_s", "0.3"}}}));
  EXPECT_GT(joined->counters().duplicates, 0u);
}

TEST_P(EachFault, AdjacentSwaps) {
  const Counters& c =
      run(script({{{"kind", "reorder"}, {"at_s", "0.5"}, {"for_s", "2"}, {"p", "0.1"}, {"depth", "1"}}})).counters();
  EXPECT_EQ(c.lost_network, 0u);
  if (!slow()) {
    EXPECT_GT(c.reordered, 0u);
  }
}

TEST_P(EachFault, ReorderingThreeDeep) {
  const Counters& c = run(script({{{"kind", "reorder"},
                                   {"at_s", "0.5"},
                                   {"for_s", "2"},
                                   {"p", "0.1"},
                                   {"depth", "3"},
                                   {"delay_s", "0.018"}}}))
                          .counters();
  EXPECT_EQ(c.lost_network, 0u);
}

TEST_P(EachFault, DelayWithJitter) {
  run(script({{{"kind", "delay"}, {"at_s", "0.5"}, {"for_s", "2"}, {"delay_s", "0.05"}, {"jitter_s", "0.05"}}}), 4s);
  EXPECT_EQ(joined->counters().lost_network, 0u);
}

TEST_P(EachFault, JitterAlone) {
  run(script({{{"kind", "jitter"},
               {"at_s", "0.5"},
               {"for_s", "2"},
               {"mean_s", "0.0002"},
               {"p", "0.02"},
               {"spike_s", "0.02"}}}),
      4s);
  EXPECT_EQ(joined->counters().lost_network, 0u);
  EXPECT_EQ(joined->counters().reordered, 0u);
}

TEST_P(EachFault, ShortBlocksLackTheirLastRecords) {
  run(script({{{"kind", "short_block"}, {"at_s", "0.5"}, {"for_s", "2"}, {"p", "0.1"}, {"records", "5"}}}));
  EXPECT_EQ(joined->counters().lost_network, joined->wire().truth().records_left_out);
  if (GetParam().manner.records_per_datagram > 1) {
    EXPECT_GT(joined->counters().lost_network, 0u);
  }
}

TEST_P(EachFault, PauseThenBurst) {
  run(script({{{"kind", "hold"}, {"at_s", "1"}, {"for_s", "0.3"}}}));
  EXPECT_EQ(joined->counters().lost_network, 0u);
}

TEST_P(EachFault, WrongSizes) {
  for (const char* size : {"0", "1", "35", "37", "71", "1441", "1476"}) {
    run(script({{{"kind", "wrong_size"}, {"at_s", "0.5"}, {"for_s", "1"}, {"p", "0.1"}, {"size", size}}}));
    EXPECT_GT(joined->counters().malformed, 0u) << size;
    EXPECT_EQ(joined->counters().lost_network, 0u) << size;
  }
}

TEST_P(EachFault, WrongSizesInsteadOfDatagrams) {
  run(script(
      {{{"kind", "wrong_size"}, {"at_s", "0.5"}, {"for_s", "1"}, {"p", "0.1"}, {"size", "71"}, {"replaces", "1"}}}));
  EXPECT_GT(joined->counters().malformed, 0u);
  EXPECT_GT(joined->counters().lost_network, 0u);
}

TEST_P(EachFault, ForeignSourcesAreNotHeard) {
  run(script({{{"kind", "foreign_source"}, {"at_s", "0"}, {"for_s", "2"}, {"p", "0.5"}}}));
  EXPECT_GT(joined->wire().truth().foreign, 0u);
}

TEST_P(EachFault, LostStarts) {
  run(script({{{"kind", "lost_start"}, {"at_s", "0"}, {"count", "3"}}}), 6s);
  EXPECT_EQ(joined->wire().truth().starts, 4u);
}

TEST_P(EachFault, DoubledStart) {
  run(script({{{"kind", "doubled_start"}, {"at_s", "0"}, {"count", "1"}, {"delay_s", "0.9"}}}));
  EXPECT_EQ(joined->counters().restarts, 1u);
}

TEST_P(EachFault, DelayedStart) {
  run(script({{{"kind", "delayed_start"}, {"at_s", "0"}, {"count", "1"}, {"delay_s", "0.05"}}}));
}

TEST_P(EachFault, RestartUnasked) {
  run(script({{{"kind", "restart"}, {"at_s", "1.5"}}}));
  EXPECT_EQ(joined->counters().restarts, 1u);
}

TEST_P(EachFault, StreamTakenOverIsTakenBackWhenAsked) {
  run(script({{{"kind", "taken_over"}, {"at_s", "1.5"}}}), 5s);
  EXPECT_EQ(joined->silences(), 1);
  EXPECT_EQ(joined->counters().restarts, 1u);
  EXPECT_GT(joined->counters().lost_network, 0u);
}

TEST_P(EachFault, StreamTakenOverStaysSilent) {
  Manner manner = GetParam().manner;
  manner.start_again_when_silent = false;
  Joined j(manner, script({{{"kind", "taken_over"}, {"at_s", "1.5"}}}), 42);
  j.run_until(5s);
  j.finish();
  EXPECT_EQ(j.session().state(), State::silent);
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_EQ(j.wire().truth().starts, 1u);
}

TEST_P(EachFault, RebootWithResume) {
  run(script({{{"kind", "reboot"}, {"at_s", "1.5"}, {"down_s", "0.2"}, {"resume", "1"}}}));
  EXPECT_EQ(joined->counters().reboots, 1u);
}

TEST_P(EachFault, RebootWithoutResume) {
  run(script({{{"kind", "reboot"}, {"at_s", "1.5"}, {"down_s", "0.2"}}}), 6s);
  EXPECT_EQ(joined->counters().reboots, 1u);
  EXPECT_EQ(joined->silences(), 1);
}

TEST_P(EachFault, Stall) {
  run(script({{{"kind", "stall"}, {"at_s", "1.5"}, {"for_s", "0.4"}}}));
  EXPECT_GT(joined->counters().stalled, 0u);
}

TEST_P(EachFault, AJumpBackReadsAsReboot) {
  for (const char* samples : {"700", "70000"}) {
    run(script({{{"kind", "ft_jump_back"}, {"at_s", "1.5"}, {"samples", samples}}}));
    EXPECT_EQ(joined->counters().reboots, 1u) << samples;
  }
}

TEST_P(EachFault, AnOverrunIsIrregularAndItsSamplesAreMissing) {
  for (const char* samples : {"1", "3", "50", "1000"}) {
    run(script({{{"kind", "overrun"}, {"at_s", "1.5"}, {"samples", samples}}}));
    EXPECT_EQ(joined->counters().irregular, 1u) << samples;
    const auto divisor = static_cast<std::uint64_t>(GetParam().manner.divisor);
    EXPECT_EQ(joined->counters().lost_network, (std::stoul(samples) + divisor / 2) / divisor) << samples;
  }
}

TEST_P(EachFault, AChangedRateIsIrregular) {
  Manner manner = GetParam().manner;
  manner.quirks.rate_write = sim::NetBoxQuirks::RateWrite::continues;
  Joined j(manner, script({{{"kind", "rate"}, {"at_s", "1.5"}, {"rate_hz", "500"}}}), 42);
  j.run_until(3s);
  j.finish();
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_NEAR(static_cast<double>(j.counters().irregular), 750, 40);
  EXPECT_EQ(j.wire().truth().done.at(sim::FaultKind::rate), 1u);
}

TEST_P(EachFault, ARateWrittenStopsMostBoxes) {
  Manner manner = GetParam().manner;
  manner.start_again_when_silent = false;
  Joined j(manner, script({{{"kind", "rate"}, {"at_s", "1.5"}, {"rate_hz", "500"}}}), 42);
  j.run_until(4s);
  EXPECT_EQ(j.session().state(), State::silent);
  EXPECT_EQ(j.disagreement(), "");
}

TEST_P(EachFault, WrapOfTheInternalSequence) {
  run(script({{{"kind", "wrap"}, {"at_s", "0"}, {"samples", "9000"}}}));
  EXPECT_EQ(joined->counters().lost_network, 0u);
  EXPECT_EQ(joined->counters().reboots, 0u);
}

TEST_P(EachFault, WrapWithLoss) {
  run(script({{{"kind", "wrap"}, {"at_s", "0"}, {"samples", "9000"}},
              {{"kind", "loss"}, {"at_s", "0.5"}, {"for_s", "1.5"}, {"p", "0.2"}}}));
}

TEST_P(EachFault, ClockSkewIsNoLoss) {
  run(script({{{"kind", "clock_skew"}, {"at_s", "0"}, {"ppm", "100"}, {"wander_ppm", "5"}, {"period_s", "10"}}}));
  EXPECT_EQ(joined->counters().lost_network, 0u);
}

TEST_P(EachFault, AnAddressGivenAnewLeavesSilence) {
  Manner manner = GetParam().manner;
  manner.start_again_when_silent = false;
  Joined j(manner, script({{{"kind", "address"}, {"at_s", "1.5"}, {"address", "127.0.0.2"}}}), 42);
  j.run_until(4s);
  j.finish();
  EXPECT_EQ(j.session().state(), State::silent);
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_EQ(j.wire().truth().done.at(sim::FaultKind::address), 1u);
}

TEST_P(EachFault, AnAddressGivenBackIsALongGap) {
  run(script({{{"kind", "address"}, {"at_s", "1.5"}, {"for_s", "0.3"}, {"address", "127.0.0.2"}}}));
  EXPECT_NEAR(static_cast<double>(joined->counters().lost_network), 2100.0 / GetParam().manner.divisor, 41);
}

TEST_P(EachFault, ZeroDriftIsInTheRecordsOnly) {
  run(script({{{"kind", "zero_drift"}, {"at_s", "0"}, {"axis", "0"}, {"amount", "-2"}, {"tau_s", "1"}}}));
  const LoadCellRecord& last = joined->out().back();
  EXPECT_NEAR(last.counts[0], -2e6 * (1 - std::exp(-to_seconds(last.arrival()))), 2e4);
  EXPECT_EQ(joined->counters().lost_network, 0u);
}

TEST_P(EachFault, UnitsChangedMidRunScaleTheCounts) {
  run(script({{{"kind", "units"}, {"at_s", "1.5"}, {"force_unit", "1"}}}));
  EXPECT_EQ(joined->out().back().counts[2], 0) << "at 1 count per lbf";
  EXPECT_EQ(joined->counters().lost_network, 0u);
}

/// Momentary: gone with the fault. Latched: until a power cycle.
TEST_P(EachFault, EveryStatusBitMomentaryAndLatched) {
  for (unsigned bit = 0; bit < 32; ++bit) {
    for (const bool latched : {false, true}) {
      const std::uint32_t bits = 1u << bit;
      Joined j(GetParam().manner,
               script({{{"kind", "status"},
                        {"at_s", "0.2"},
                        {"for_s", "0.1"},
                        {"bits", std::to_string(bits)},
                        {"latched", latched ? "1" : "0"}}}),
               42);
      j.run_until(400ms);
      j.finish();
      ASSERT_EQ(j.disagreement(), "") << bit;
      const auto shown =
          std::count_if(j.out().begin(), j.out().end(), [&](const LoadCellRecord& r) { return r.status == bits; });
      const double expected = (latched ? 1400.0 : 700.0) / GetParam().manner.divisor;
      ASSERT_NEAR(static_cast<double>(shown), expected, 41) << bit;
    }
  }
}

TEST_P(EachFault, StatusBitsDoNotTouchTheAccount) {
  run(script({{{"kind", "status"}, {"at_s", "1"}, {"for_s", "0.5"}, {"bits", "0x80400000"}}}));
  const auto bad = std::count_if(joined->out().begin(), joined->out().end(),
                                 [](const LoadCellRecord& r) { return r.status == 0x80400000u; });
  EXPECT_NEAR(static_cast<double>(bad), 3500.0 / GetParam().manner.divisor, 1);
}

TEST_P(EachFault, SaturationIsInTheRecords) {
  run(script({{{"kind", "saturation"}, {"at_s", "1"}, {"for_s", "0.5"}, {"axes", "4"}}}));
  for (const LoadCellRecord& r : joined->out()) ASSERT_EQ(r.status == 0x80020000u, r.counts[2] == 60'000'000);
}

/// Of a finite request, as another client may send it.
TEST(LastBlock, PartialPaddedOrDroppedIsAccountedFor) {
  using LastBlock = sim::NetBoxQuirks::LastBlock;
  const std::map<LastBlock, std::uint64_t> expected{
      {LastBlock::partial, 100}, {LastBlock::padded, 120}, {LastBlock::dropped, 80}};
  for (const auto& [habit, records] : expected) {
    sim::NetBoxSettings settings;
    settings.quirks.last_block = habit;
    sim::NetBoxDevice box(settings);
    sim::FaultInjector wire(box, {}, 1);
    Session session{StreamSettings{}};
    session.start(Instant{0});
    session.advance(session.deadline());
    wire.request(std::array<std::uint8_t, 8>{0x12, 0x34, 0, 3, 0, 0, 0, 100}, 7, Instant{0});
    std::vector<LoadCellRecord> out;
    sim::Datagram datagram;
    for (std::int64_t tick = 1; tick <= 700; ++tick) {
      const Instant now(10'000'000 + tick * 1'000'000 / 7);
      wire.sample({now, {}});
      while (wire.next_datagram(datagram, now)) session.receive(datagram.payload(), now, out);
    }
    EXPECT_EQ(out.size(), records);
    EXPECT_EQ(session.counters().lost_network + session.counters().malformed, 0u);
  }
}

constexpr Manner blocks_of(int records, int divisor, std::uint32_t first_ft = 0) {
  return {records, divisor, first_ft, true, {}};
}

INSTANTIATE_TEST_SUITE_P(, EachFault,
                         testing::Values(Mode{"Buffered40At7000", blocks_of(40, 1)},
                                         Mode{"Buffered7At7000", blocks_of(7, 1, 4294960000u)},
                                         Mode{"SinglesAt7000", blocks_of(1, 1)},
                                         Mode{"SinglesAt1000", blocks_of(1, 7)}),
                         [](const auto& mode) { return std::string(mode.param.name); });

}  // namespace each_fault_test
}  // namespace kphi::netbox::test
