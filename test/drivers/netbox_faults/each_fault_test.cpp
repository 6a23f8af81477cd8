// Each fault alone: the driver's account equals the simulator's truth, and what it delivers is what was sent, in order,
// once, each record with the time of its first arrival.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "test/drivers/netbox_faults/joined.hpp"
#include "test/drivers/sim/fault_words.hpp"

namespace kphi::netbox::test::each_fault_test {

using namespace std::chrono_literals;
using sim::test::fault_script;
using C = Counters;

struct Mode {
  const char* name;
  Manner manner;
};

constexpr Manner blocks_of(int records, int divisor, std::uint32_t first_ft = 0) {
  return {records, divisor, first_ft, true, {}};
}

const auto kModes =
    testing::Values(Mode{"Buffered40At7000", blocks_of(40, 1)}, Mode{"Buffered7At7000", blocks_of(7, 1, 4294960000u)},
                    Mode{"SinglesAt7000", blocks_of(1, 1)}, Mode{"SinglesAt1000", blocks_of(1, 7)});

/// Runs three seconds and expects agreement.
void run_in(std::optional<Joined>& joined, const Manner& manner, const std::vector<std::string>& faults,
            Instant end = 3s) {
  joined.emplace(manner, fault_script(faults), 42);
  joined->agree_until(end);
  EXPECT_GT(joined->counters().received, 0u);
}

/// What the account says of it, beside agreeing with the truth.
struct Case {
  const char* name;
  std::vector<std::string> faults;
  std::vector<std::uint64_t C::*> some = {}, none = {}, one = {};
  Instant end = 3s;
};

const Case kCases[] = {
    {"NoneAtAll", {}, {}, {&C::lost_network, &C::duplicates}},
    {"UniformLoss", {"loss at_s=0.5 for_s=2 p=0.1"}, {&C::lost_network}},
    {"BurstLoss", {"loss at_s=0.5 for_s=2 p=0.05 burst=7"}, {&C::lost_network}},
    {"GilbertElliottLoss", {"gilbert at_s=0.5 for_s=2 p_good_bad=0.05 p_bad_good=0.3 loss=0.8"}, {&C::lost_network}},
    {"Duplicates", {"duplicate at_s=0.5 for_s=2 p=0.2"}, {&C::duplicates}},
    {"DuplicatesMuchLater", {"duplicate at_s=0.5 for_s=1 p=0.2 delay_s=0.3"}, {&C::duplicates}},
    {"ReorderingThreeDeep", {"reorder at_s=0.5 for_s=2 p=0.1 depth=3 delay_s=0.018"}, {}, {&C::lost_network}},
    {"DelayWithJitter", {"delay at_s=0.5 for_s=2 delay_s=0.05 jitter_s=0.05"}, {}, {&C::lost_network}, {}, 4s},
    {"JitterAlone",
     {"jitter at_s=0.5 for_s=2 mean_s=0.0002 p=0.02 spike_s=0.02"},
     {},
     {&C::lost_network, &C::reordered},
     {},
     4s},
    {"PauseThenBurst", {"hold at_s=1 for_s=0.3"}, {}, {&C::lost_network}},
    {"WrongSizesInsteadOfDatagrams",
     {"wrong_size at_s=0.5 for_s=1 p=0.1 size=71 replaces=1"},
     {&C::malformed, &C::lost_network}},
    {"DoubledStart", {"doubled_start at_s=0 count=1 delay_s=0.9"}, {}, {}, {&C::restarts}},
    {"DelayedStart", {"delayed_start at_s=0 count=1 delay_s=0.05"}},
    {"RestartUnasked", {"restart at_s=1.5"}, {}, {}, {&C::restarts}},
    {"RebootWithResume", {"reboot at_s=1.5 down_s=0.2 resume=1"}, {}, {}, {&C::reboots}},
    {"Stall", {"stall at_s=1.5 for_s=0.4"}, {&C::stalled}},
    {"AJumpBackReadsAsReboot", {"ft_jump_back at_s=1.5 samples=700"}, {}, {}, {&C::reboots}},
    {"ALongJumpBackReadsAsReboot", {"ft_jump_back at_s=1.5 samples=70000"}, {}, {}, {&C::reboots}},
    {"WrapOfTheInternalSequence", {"wrap at_s=0 samples=9000"}, {}, {&C::lost_network, &C::reboots}},
    {"WrapWithLoss", {"wrap at_s=0 samples=9000", "loss at_s=0.5 for_s=1.5 p=0.2"}},
    {"ClockSkewIsNoLoss", {"clock_skew at_s=0 ppm=100 wander_ppm=5 period_s=10"}, {}, {&C::lost_network}},
};

class OfEachFault : public testing::TestWithParam<std::tuple<Mode, Case>> {};

TEST_P(OfEachFault, TheAccountIsTheTruth) {
  const auto& [mode, fault] = GetParam();
  std::optional<Joined> joined;
  run_in(joined, mode.manner, fault.faults, fault.end);
  for (const auto counter : fault.some) EXPECT_GT(joined->counters().*counter, 0u);
  for (const auto counter : fault.none) EXPECT_EQ(joined->counters().*counter, 0u);
  for (const auto counter : fault.one) EXPECT_EQ(joined->counters().*counter, 1u);
}

INSTANTIATE_TEST_SUITE_P(, OfEachFault, testing::Combine(kModes, testing::ValuesIn(kCases)), [](const auto& one) {
  return std::string(std::get<1>(one.param).name) + std::get<0>(one.param).name;
});

class EachBoxFault : public testing::TestWithParam<Mode> {
 protected:
  Joined& run(const std::vector<std::string>& faults, Instant end = 3s) {
    run_in(joined, GetParam().manner, faults, end);
    return *joined;
  }
  [[nodiscard]] bool slow() const { return GetParam().manner.divisor > 10; }
  std::optional<Joined> joined;
};

INSTANTIATE_TEST_SUITE_P(, EachBoxFault, kModes, [](const auto& mode) { return std::string(mode.param.name); });

TEST_P(EachBoxFault, AStreamTakenOverStoppedOrElsewhereStaysSilent) {
  for (const char* fault : {"taken_over at_s=1.5", "rate at_s=1.5 rate_hz=500", "address at_s=1.5 address=127.0.0.2"}) {
    SCOPED_TRACE(fault);
    Manner manner = GetParam().manner;
    manner.start_again_when_silent = false;
    Joined j(manner, fault_script({fault}), 42);
    j.agree_until(5s);
    EXPECT_EQ(j.session().state(), State::silent);
    EXPECT_EQ(j.wire().truth().starts, 1u);
    EXPECT_EQ(j.wire().truth().done.at(fault_script({fault})[0].kind), 1u);
  }
}

TEST_P(EachBoxFault, AdjacentSwaps) {
  const Counters& c = run({"reorder at_s=0.5 for_s=2 p=0.1 depth=1"}).counters();
  EXPECT_EQ(c.lost_network, 0u);
  if (!slow()) {
    EXPECT_GT(c.reordered, 0u);
  }
}

TEST_P(EachBoxFault, ShortBlocksLackTheirLastRecords) {
  run({"short_block at_s=0.5 for_s=2 p=0.1 records=5"});
  EXPECT_EQ(joined->counters().lost_network, joined->wire().truth().records_left_out);
  if (GetParam().manner.records_per_datagram > 1) {
    EXPECT_GT(joined->counters().lost_network, 0u);
  }
}

TEST_P(EachBoxFault, WrongSizes) {
  for (const char* size : {"0", "1", "35", "37", "71", "1441", "1476"}) {
    run({std::string("wrong_size at_s=0.5 for_s=1 p=0.1 size=") + size});
    EXPECT_GT(joined->counters().malformed, 0u) << size;
    EXPECT_EQ(joined->counters().lost_network, 0u) << size;
  }
}

TEST_P(EachBoxFault, ForeignSourcesAreNotHeard) {
  run({"foreign_source at_s=0 for_s=2 p=0.5"});
  EXPECT_GT(joined->wire().truth().foreign, 0u);
}

TEST_P(EachBoxFault, LostStarts) {
  run({"lost_start at_s=0 count=3"}, 6s);
  EXPECT_EQ(joined->wire().truth().starts, 4u);
}

TEST_P(EachBoxFault, StreamTakenOverIsTakenBackWhenAsked) {
  run({"taken_over at_s=1.5"}, 5s);
  EXPECT_EQ(joined->silences(), 1);
  EXPECT_EQ(joined->counters().restarts, 1u);
  EXPECT_GT(joined->counters().lost_network, 0u);
}

TEST_P(EachBoxFault, RebootWithoutResume) {
  run({"reboot at_s=1.5 down_s=0.2"}, 6s);
  EXPECT_EQ(joined->counters().reboots, 1u);
  EXPECT_EQ(joined->silences(), 1);
}

TEST_P(EachBoxFault, AnOverrunIsIrregularAndItsSamplesAreMissing) {
  for (const char* samples : {"1", "3", "50", "1000"}) {
    run({std::string("overrun at_s=1.5 samples=") + samples});
    EXPECT_EQ(joined->counters().irregular, 1u) << samples;
    const auto divisor = static_cast<std::uint64_t>(GetParam().manner.divisor);
    EXPECT_EQ(joined->counters().lost_network, (std::stoul(samples) + divisor / 2) / divisor) << samples;
  }
}

TEST_P(EachBoxFault, AChangedRateIsIrregular) {
  Manner manner = GetParam().manner;
  manner.quirks.rate_write = sim::NetBoxQuirks::RateWrite::continues;
  Joined j(manner, fault_script({"rate at_s=1.5 rate_hz=500"}), 42);
  j.agree_until(3s);
  EXPECT_NEAR(static_cast<double>(j.counters().irregular), 750, 40);
  EXPECT_EQ(j.wire().truth().done.at(sim::FaultKind::rate), 1u);
}

TEST_P(EachBoxFault, AnAddressGivenBackIsALongGap) {
  run({"address at_s=1.5 for_s=0.3 address=127.0.0.2"});
  EXPECT_NEAR(static_cast<double>(joined->counters().lost_network), 2100.0 / GetParam().manner.divisor, 41);
}

TEST_P(EachBoxFault, ZeroDriftIsInTheRecordsOnly) {
  run({"zero_drift at_s=0 axis=0 amount=-2 tau_s=1"});
  const LoadCellRecord& last = joined->out().back();
  EXPECT_NEAR(last.counts[0], -2e6 * (1 - std::exp(-to_seconds(last.arrival()))), 2e4);
  EXPECT_EQ(joined->counters().lost_network, 0u);
}

TEST_P(EachBoxFault, UnitsChangedMidRunScaleTheCounts) {
  run({"units at_s=1.5 force_unit=1"});
  EXPECT_EQ(joined->out().back().counts[2], 0) << "at 1 count per lbf";
  EXPECT_EQ(joined->counters().lost_network, 0u);
}

/// Momentary: gone with the fault. Latched: until a power cycle.
TEST_P(EachBoxFault, EveryStatusBitMomentaryAndLatched) {
  for (unsigned bit = 0; bit < 32; ++bit) {
    for (const bool latched : {false, true}) {
      const std::uint32_t bits = 1u << bit;
      const std::string fault = fmt::format("status at_s=0.2 for_s=0.1 bits={} latched={:d}", bits, latched);
      Joined j(GetParam().manner, fault_script({fault}), 42);
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

TEST_P(EachBoxFault, StatusBitsDoNotTouchTheAccount) {
  run({"status at_s=1 for_s=0.5 bits=0x80400000"});
  const auto bad = std::count_if(joined->out().begin(), joined->out().end(),
                                 [](const LoadCellRecord& r) { return r.status == 0x80400000u; });
  EXPECT_NEAR(static_cast<double>(bad), 3500.0 / GetParam().manner.divisor, 1);
}

TEST_P(EachBoxFault, SaturationIsInTheRecords) {
  run({"saturation at_s=1 for_s=0.5 axes=4"});
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

}  // namespace kphi::netbox::test::each_fault_test
