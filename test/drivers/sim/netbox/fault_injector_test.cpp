// The faulty wire by itself: what arrives, when, and what it says about it.
#include "drivers/sim/netbox/fault_injector.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "drivers/sim/physics/motor.hpp"
#include "drivers/sim/truth_log.hpp"
#include "test/drivers/sim/fault_words.hpp"
#include "test/drivers/sim/netbox/box.hpp"

namespace kphi::sim::fault_injector_test {

using namespace std::chrono_literals;
using namespace test;
using Keep = FaultInjector::Keep;

constexpr Peer kHost = 7;
using Entries = std::vector<std::string>;

struct Bench {
  explicit Bench(const Entries& entries, std::uint64_t seed = 1, Keep keep = Keep::samples)
      : wire(box, fault_script(entries), seed, keep) {
    wire.request(kRealTime, kHost, Instant{0});
  }
  /// Ticks on, taking what has arrived after each `step` ticks.
  std::vector<Datagram> run(int ticks, int step = 1) {
    std::vector<Datagram> all;
    Datagram next;
    for (int i = 0; i < ticks; ++i) {
      ++tick;
      now = Instant(tick * 1'000'000 / 7);
      wire.sample({now, {0, 0, 1, 0, 0, 0}});
      if (tick % step == 0)
        while (wire.next_datagram(next, now)) all.push_back(next);
    }
    return all;
  }
  NetBoxDevice box = box_that([](NetBoxSettings& settings) { settings.rate_hz = 1000; });
  FaultInjector wire;
  std::int64_t tick = 0;
  Instant now{0};
};

TEST(FaultInjector, WithoutFaultsPassesAllAtOnce) {
  Bench bench(Entries{});
  const auto arrived = bench.run(7000);
  ASSERT_EQ(arrived.size(), 1000u);
  for (const Datagram& d : arrived) EXPECT_EQ(d.at, d.sampled[0]);
  EXPECT_EQ(bench.wire.truth().arrived, 1000u);
  EXPECT_EQ(bench.wire.truth().log.size(), 1000u);
  EXPECT_EQ(bench.wire.truth().sampled.size(), 1000u);
}

TEST(FaultInjector, LosesAtMostAsManyAsTold) {
  Bench bench({"loss at_s=0.1 count=5"});
  EXPECT_EQ(bench.run(7000).size(), 995u);
  EXPECT_EQ(bench.wire.truth().dropped, 5u);
  EXPECT_EQ(bench.wire.truth().records_dropped, 5u);
}

TEST(FaultInjector, LosesInBursts) {
  Bench bench({"loss at_s=0 for_s=10 p=0.02 burst=6"});
  const auto arrived = bench.run(70000);
  for (std::size_t i = 1; i < arrived.size(); ++i) {
    const std::uint32_t lost = rdt(arrived[i]) - rdt(arrived[i - 1]) - 1;
    ASSERT_EQ(lost % 6, 0u);
  }
  EXPECT_NEAR(static_cast<double>(bench.wire.truth().dropped), 10000 * 0.12 / 1.1, 250);
}

TEST(FaultInjector, GilbertElliottLosesItsShare) {
  Bench bench({"gilbert at_s=0 for_s=60 p_good_bad=0.01 p_bad_good=0.09"});
  bench.run(420000, 70);
  EXPECT_NEAR(static_cast<double>(bench.wire.truth().dropped), 6000, 1000) << "a tenth of the time is bad";
}

TEST(FaultInjector, DuplicatesLater) {
  Bench bench({"duplicate at_s=0 count=1 delay_s=0.0105"});
  const auto arrived = bench.run(700);
  ASSERT_EQ(arrived.size(), 101u);
  EXPECT_EQ(rdt(arrived[11]), 1u);
  EXPECT_EQ(arrived[11].at, arrived[0].at + 10500us);
  EXPECT_EQ(bench.wire.truth().duplicated, 1u);
  EXPECT_EQ(bench.wire.truth().log[0].arrivals, 2u);
}

TEST(FaultInjector, LetsTheNextOnesOvertake) {
  Bench bench({"reorder at_s=0 count=1 depth=3"});
  const auto arrived = bench.run(70);
  EXPECT_EQ(rdt(arrived[2]), 4u);
  EXPECT_EQ(rdt(arrived[3]), 1u);
  EXPECT_EQ(rdt(arrived[4]), 5u);
  EXPECT_EQ(bench.wire.truth().overtaken, 1u);
}

TEST(FaultInjector, HoldsNothingBackLongerThanTold) {
  Bench bench({"reorder at_s=0 count=1 depth=900 delay_s=0.02"});
  const auto arrived = bench.run(700);
  const auto first = std::find_if(arrived.begin(), arrived.end(), [](const Datagram& d) { return rdt(d) == 1; });
  ASSERT_NE(first, arrived.end());
  EXPECT_EQ(first->at, first->sampled[0] + 20ms);
}

TEST(FaultInjector, DelaysInOrder) {
  Bench bench({"delay at_s=0 for_s=0.05 delay_s=0.02 jitter_s=0.01"});
  const auto arrived = bench.run(1400);
  ASSERT_EQ(arrived.size(), 200u);
  for (std::size_t i = 1; i < arrived.size(); ++i) {
    EXPECT_EQ(rdt(arrived[i]), rdt(arrived[i - 1]) + 1);
    EXPECT_GE(arrived[i].at, arrived[i - 1].at);
  }
  EXPECT_GE(arrived[0].at - arrived[0].sampled[0], 20ms);
  EXPECT_LE(arrived[0].at - arrived[0].sampled[0], 30ms);
}

TEST(FaultInjector, JittersByAnExponentialAndSomeSpikes) {
  Bench bench({"jitter at_s=0 for_s=100 mean_s=0.00002 p=0.01 spike_s=0.0009"});
  const auto arrived = bench.run(70000);
  double sum = 0;
  int late = 0;
  for (const Datagram& d : arrived) {
    const double delay = to_seconds(d.at - d.sampled[0]);
    ASSERT_GE(delay, 0);
    sum += delay;
    if (delay > 0.0002) ++late;
  }
  EXPECT_NEAR(sum / static_cast<double>(arrived.size()), 20e-6 + 0.01 * 450e-6, 1e-6);
  EXPECT_NEAR(late, 0.01 * 7 / 9 * 10000, 30) << "those whose spike is longer than 0.2 ms";
}

TEST(FaultInjector, ShortBlocksLackTheirEnd) {
  NetBoxDevice box = box_that([](NetBoxSettings& settings) { settings.records_per_datagram = 10; });
  FaultInjector wire(box, fault_script({"short_block at_s=0 count=2 records=15"}), 1);
  wire.request(bytes("12 34 00 03 00 00 00 00"), kHost, Instant{0});
  for (int i = 1; i <= 30; ++i) wire.sample({Instant(i), {}});
  std::vector<std::size_t> sizes;
  for (Datagram d; wire.next_datagram(d, Instant(99));) sizes.push_back(d.size / 36);
  EXPECT_EQ(sizes, (std::vector<std::size_t>{1, 1, 10}));
  EXPECT_EQ(wire.truth().records_left_out, 18u);
  EXPECT_EQ(wire.truth().records_sent, 12u);
}

TEST(FaultInjector, OverrunsAndChangesItsRate) {
  Bench overrun({"overrun at_s=0.05 samples=3"});
  const auto arrived = overrun.run(700);
  EXPECT_EQ(ft(arrived[50]), ft(arrived[49]) + 7 + 3);
  EXPECT_EQ(rdt(arrived[50]), rdt(arrived[49]) + 1);
  EXPECT_EQ(overrun.wire.truth().done.at(FaultKind::overrun), 1u);
  Bench rate({"rate at_s=0.05 rate_hz=500"});
  EXPECT_EQ(rate.run(700).size(), 50u) << "a box whose stream stops with the write";
  EXPECT_EQ(rate.box.divisor(), 14);
}

TEST(FaultInjector, DriftsToItsAmount) {
  Bench bench({"zero_drift at_s=1 axis=2 amount=0.5 tau_s=2"});
  bench.run(7000);
  EXPECT_EQ(bench.box.signal().counts()[2], 1'000'000);
  bench.run(14000, 70);
  EXPECT_NEAR(bench.box.signal().counts()[2], 1e6 + 0.5e6 * (1 - std::exp(-1.0)), 2);
  bench.run(140000, 70);
  EXPECT_NEAR(bench.box.signal().counts()[2], 1.5e6, 50);
}

TEST(FaultInjector, MovesToAnotherAddressAndBack) {
  Bench bench({"address at_s=0.05 for_s=0.05 address=10.1.2.3"});
  EXPECT_EQ(bench.wire.moved_to(), "");
  bench.run(400);
  EXPECT_EQ(bench.wire.moved_to(), "10.1.2.3");
  EXPECT_EQ(bench.box.settings().address, "10.1.2.3");
  bench.run(400);
  EXPECT_EQ(bench.wire.moved_to(), "");
  EXPECT_EQ(bench.box.settings().address, "127.0.0.1");
}

TEST(FaultInjector, SpoilsTagsAndLetters) {
  Bench bench({"http_missing_tag at_s=0 for_s=0.01 tag=cfgcpf", "http_duplicate_tag at_s=0.02 for_s=0.01 tag=cfgcpf",
               "http_charset at_s=0.04 for_s=0.01", "http_charset at_s=0.06 for_s=0.01 utf16=1",
               "http_missing_tag at_s=0.08 for_s=0.01 tag=nosuch"});
  const auto get = [&](Instant at) { return bench.wire.http("GET /netftapi2.xml HTTP/1.0", at).bytes; };
  const auto count = [](const std::string& text, const std::string& what) {
    int n = 0;
    for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count(get(1ms), "<cfgcpf>"), 0);
  EXPECT_EQ(count(get(25ms), "<cfgcpf>1000000</cfgcpf>\n"), 2);
  EXPECT_EQ(count(get(45ms), "<cfgnam>Pr\xfc"), 1);
  EXPECT_EQ(count(get(65ms), std::string("<\0n\0e\0t\0f\0t\0>\0", 14)), 1);
  EXPECT_EQ(count(get(85ms), "</netft>"), 1);
  for (const Instant at : {1ms, 25ms, 45ms, 65ms, 85ms}) {
    const std::string answer = get(at);
    const std::size_t body = answer.size() - answer.find("\r\n\r\n") - 4;
    EXPECT_EQ(count(answer, "Content-Length: " + std::to_string(body) + "\r\n"), 1);
  }
}

TEST(FaultInjector, SplitsMergesAndShortensAnswersOverTcp) {
  Bench bench({"tcp_split at_s=0 count=1 size=5", "tcp_merged at_s=0.02 count=1 delay_s=0.3",
               "tcp_short at_s=0.04 count=1 size=9"});
  const auto ask = [&](Instant at) {
    std::string command(20, '\0');
    command[0] = 1;
    return bench.wire.tcp(command, at);
  };
  EXPECT_EQ(ask(1ms).segment, 5u);
  EXPECT_EQ(ask(2ms).segment, 0u) << "once";
  EXPECT_EQ(ask(21ms).wait, 300ms);
  const StreamReply cut = ask(41ms);
  EXPECT_EQ(cut.bytes.size(), 9u);
  EXPECT_TRUE(cut.close);
  std::string half(10, '\0');
  EXPECT_EQ(bench.wire.tcp(half, 50ms).bytes, "");
  EXPECT_EQ(bench.wire.truth().done.at(FaultKind::tcp_short), 1u);
}

TEST(FaultInjector, HoldsThenBursts) {
  Bench bench({"hold at_s=0.1 for_s=0.2"});
  EXPECT_EQ(bench.run(2099).size(), 100u);
  EXPECT_EQ(bench.wire.next_arrival(), 300ms);
  const auto burst = bench.run(1);
  EXPECT_EQ(burst.size(), 200u);
  for (const Datagram& d : burst) EXPECT_EQ(d.at, 300ms);
}

TEST(FaultInjector, MakesUpWrongSizesAndForeigners) {
  Bench bench({"wrong_size at_s=0 count=2 size=1476", "foreign_source at_s=0.05 count=3"});
  const auto arrived = bench.run(700);
  EXPECT_EQ(std::count_if(arrived.begin(), arrived.end(), [](const Datagram& d) { return d.size == 1476; }), 2);
  EXPECT_EQ(std::count_if(arrived.begin(), arrived.end(), [](const Datagram& d) { return d.foreign; }), 3);
  EXPECT_EQ(arrived.size(), 105u);
  EXPECT_EQ(bench.wire.truth().malformed, 2u);
  EXPECT_EQ(bench.wire.truth().foreign, 3u);
  EXPECT_EQ(bench.wire.truth().arrived, 100u);
}

TEST(FaultInjector, LosesDoublesAndDelaysStarts) {
  Bench lost({"lost_start at_s=0 count=1"});
  EXPECT_TRUE(lost.run(70).empty());
  lost.wire.request(kRealTime, kHost, lost.now);
  EXPECT_EQ(lost.run(70).size(), 10u);
  Bench doubled({"doubled_start at_s=0 count=1 delay_s=0.005"});
  const auto arrived = doubled.run(70);
  EXPECT_EQ(rdt(arrived[4]), 5u);
  EXPECT_EQ(rdt(arrived[5]), 1u);
  Bench delayed({"delayed_start at_s=0 count=1 delay_s=0.005"});
  EXPECT_EQ(delayed.run(70).size(), 5u + 1u);
  EXPECT_EQ(delayed.wire.truth().done.at(FaultKind::delayed_start), 1u);
}

TEST(FaultInjector, AStreamTakenOverLeavesOnlySilence) {
  Bench bench({"taken_over at_s=0.1"});
  EXPECT_EQ(bench.run(7000).size(), 100u);
  EXPECT_EQ(bench.wire.truth().to_others, 901u) << "from 0.1 s to 1 s, both included";
  bench.wire.request(kRealTime, kHost, bench.now);
  EXPECT_EQ(rdt(bench.run(7).at(0)), 1u);
}

TEST(FaultInjector, RebootsWithAndWithoutTheStream) {
  Bench with({"reboot at_s=0.1 down_s=0.1 resume=true"});
  const auto arrived = with.run(7000);
  EXPECT_EQ(arrived.size(), 100u + 801u);
  EXPECT_EQ(rdt(arrived[100]), 1u);
  EXPECT_EQ(ft(arrived[100]), 0u);
  EXPECT_EQ(arrived[100].boot, 1u);
  Bench without({"reboot at_s=0.1 down_s=0.1"});
  EXPECT_EQ(without.run(1000).size(), 100u);
  without.wire.request(kRealTime, kHost, without.now);
  EXPECT_EQ(without.wire.truth().unheard, 1u) << "it is still down";
  EXPECT_TRUE(without.wire.http_refused(without.now));
  without.run(1000);
  without.wire.request(kRealTime, kHost, without.now);
  EXPECT_EQ(without.run(70).size(), 10u);
}

TEST(FaultInjector, StallsJumpsAndWraps) {
  Bench stall({"stall at_s=0.05 for_s=0.05"});
  const auto stalled = stall.run(700);
  EXPECT_EQ(ft(stalled[60]), ft(stalled[90]));
  EXPECT_EQ(rdt(stalled[99]), 100u);
  Bench jump({"ft_jump_back at_s=0.05 samples=100"});
  const auto jumped = jump.run(700);
  EXPECT_EQ(ft(jumped[50]), ft(jumped[49]) + 7 - 100);
  Bench wrap({"wrap at_s=0 samples=70"});
  const auto wrapped = wrap.run(700);
  EXPECT_EQ(ft(wrapped[0]), 0u - 70u);
  EXPECT_EQ(ft(wrapped[10]), 0u);
}

TEST(FaultInjector, ASkewedBoxTakesMoreSamplesAtItsOwnTimes) {
  Bench bench({"clock_skew at_s=0 ppm=500"});
  const auto arrived = bench.run(70000, 70);
  EXPECT_EQ(arrived.size(), 10005u);
  const double period_us = 1e6 * to_seconds(arrived[10000].sampled[0] - arrived[0].sampled[0]) / 10000;
  EXPECT_NEAR(period_us, 1000 / 1.0005, 1e-4);
  for (std::size_t i = 1; i < arrived.size(); ++i) {
    ASSERT_NEAR(1e6 * to_seconds(arrived[i].sampled[0] - arrived[i - 1].sampled[0]), 1000 / 1.0005, 0.004) << i;
  }
}

TEST(FaultInjector, StatusSaturationAndUnits) {
  Bench bench({"status at_s=0.02 for_s=0.01 bits=0x80400000", "status at_s=0.04 for_s=0.01 bits=0x10 latched=1",
               "saturation at_s=0.06 for_s=0.01 axes=4", "units at_s=0.08 force_unit=6"});
  const auto arrived = bench.run(700);
  const auto status = [&](std::size_t i) {
    return arrived[i].bytes[8] << 24 | arrived[i].bytes[9] << 16 | arrived[i].bytes[11];
  };
  EXPECT_EQ(status(10), 0);
  EXPECT_EQ(static_cast<std::uint32_t>(status(25)), 0x80400000u);
  EXPECT_EQ(status(35), 0);
  EXPECT_EQ(status(45), 0x10);
  EXPECT_EQ(status(55), 0x10);
  EXPECT_EQ(static_cast<std::uint32_t>(status(65)), 0x80020010u);
  EXPECT_EQ(bench.box.signal().counts()[2], 102) << "1 N in gf";
}

TEST(FaultInjector, SpoilsThePages) {
  Bench bench({"http_status at_s=0 count=1 code=500", "http_truncated at_s=0.01 for_s=0.01 size=20",
               "http_oversized at_s=0.03 for_s=0.01 size=65536", "http_slow at_s=0.05 for_s=0.01 delay_s=2",
               "http_refused at_s=0.07 for_s=0.01"});
  const auto get = [&](Instant at) { return bench.wire.http("GET /netftapi2.xml HTTP/1.0", at); };
  EXPECT_EQ(get(0ms).bytes.substr(0, 12), "HTTP/1.0 500");
  EXPECT_EQ(get(1ms).bytes.substr(0, 12), "HTTP/1.0 200");
  EXPECT_EQ(get(15ms).bytes.size(), 20u);
  EXPECT_GT(get(35ms).bytes.size(), 65536u);
  EXPECT_EQ(get(55ms).wait, 2s);
  EXPECT_TRUE(bench.wire.http_refused(75ms));
  EXPECT_FALSE(bench.wire.http_refused(85ms));
  EXPECT_EQ(bench.wire.truth().done.at(FaultKind::http_slow), 1u);
}

std::vector<std::uint8_t> everything(std::uint64_t seed, int step) {
  Bench bench({"loss at_s=0.1 for_s=1 p=0.1 burst=2", "reorder at_s=0.1 for_s=1 p=0.1 depth=3",
               "duplicate at_s=0.3 for_s=1 p=0.1 delay_s=0.0123", "delay at_s=0.5 for_s=1 delay_s=0.01 jitter_s=0.01",
               "wrong_size at_s=0.5 for_s=1 p=0.1 size=37", "clock_skew at_s=0 ppm=60 wander_ppm=1",
               "reboot at_s=1.6 down_s=0.1 resume=1"},
              seed);
  std::vector<std::uint8_t> out;
  for (const Datagram& d : bench.run(14000, step)) {
    out.insert(out.end(), d.payload().begin(), d.payload().end());
    for (int shift = 0; shift < 64; shift += 8) out.push_back(static_cast<std::uint8_t>(d.at.count() >> shift));
  }
  return out;
}

TEST(FaultInjector, SameSeedSameBytesAtTheSameTimes) {
  EXPECT_EQ(everything(1, 1), everything(1, 1));
  EXPECT_NE(everything(1, 1), everything(2, 1));
}

TEST(FaultInjector, DoesNotDependOnHowOftenItIsAsked) { EXPECT_EQ(everything(3, 1), everything(3, 500)); }

TEST(FaultInjector, TellsTheTruthLineByLine) {
  Bench bench({"loss at_s=0.1 count=2", "stall at_s=0.2 for_s=0.1"}, 1, Keep::datagrams);
  bench.run(7000);
  std::istringstream lines(json_lines(bench.wire.truth()));
  std::vector<nlohmann::json> all;
  for (std::string line; std::getline(lines, line);) all.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(all.size(), 2u + 1000u + 1u);
  EXPECT_EQ(all[0]["event"], "stall begins");
  EXPECT_EQ(all[1]["at_ns"], 300'000'000);
  EXPECT_EQ(all[2]["first_rdt"], 1);
  EXPECT_EQ(all.back()["totals"]["dropped"], 2);
  EXPECT_EQ(std::count_if(all.begin() + 2, all.end() - 1, [](const auto& d) { return d["arrivals"] == 0; }), 2);
}

}  // namespace kphi::sim::fault_injector_test
