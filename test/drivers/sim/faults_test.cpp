#include "drivers/sim/faults.hpp"

#include <gtest/gtest.h>

#include <set>

#include "drivers/sim/fault_file.hpp"

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;

std::string refusal(const std::string& text) {
  try {
    (void)parse_faults(text, "f.yaml");
    (void)parse_habits(text, "f.yaml");
  } catch (const FileError& error) {
    return error.what();
  }
  return "accepted";
}

const std::string kHead = "format: kphi-faults/1\nfaults:\n";

TEST(FaultFile, ReadsEveryKind) {
  const FaultScript script = parse_faults(kHead + R"(
  - {at_s: 1, for_s: 2, kind: loss, p: 0.1, burst: 3}
  - {at_s: 1, count: 5, kind: loss}
  - {at_s: 1, for_s: 2, kind: gilbert, p_good_bad: 0.1, p_bad_good: 0.5, loss: 0.9}
  - {at_s: 1, for_s: 2, kind: duplicate, p: 0.1, delay_s: 0.2}
  - {at_s: 1, for_s: 2, kind: reorder, p: 0.1, depth: 5}
  - {at_s: 1, for_s: 2, kind: delay, delay_s: 0.2, jitter_s: 0.1}
  - {at_s: 1, for_s: 2, kind: hold}
  - {at_s: 1, count: 2, kind: wrong_size, size: 35, replaces: true}
  - {at_s: 1, for_s: 2, kind: foreign_source}
  - {at_s: 0, count: 2, kind: lost_start}
  - {at_s: 0, count: 1, kind: doubled_start, delay_s: 0.5}
  - {at_s: 0, count: 1, kind: delayed_start, delay_s: 0.5}
  - {at_s: 5, kind: stolen}
  - {at_s: 5, kind: restart}
  - {at_s: 5, kind: reboot, down_s: 0.8, resume: true}
  - {at_s: 5, for_s: 1, kind: stall}
  - {at_s: 5, kind: ft_jump_back, samples: 1000}
  - {at_s: 0, kind: wrap, samples: 5000}
  - {at_s: 0, kind: clock_skew, ppm: -60, wander_ppm: 0.5}
  - {at_s: 0, for_s: 1, kind: status, bits: 0x80400000, latched: false}
  - {at_s: 0, for_s: 1, kind: saturation, axes: 4}
  - {at_s: 0, kind: units, force_unit: 1}
  - {at_s: 0, for_s: 1, kind: http_slow, delay_s: 2}
  - {at_s: 0, count: 1, kind: http_truncated, size: 100}
  - {at_s: 0, count: 1, kind: http_status, code: 500}
  - {at_s: 0, count: 1, kind: http_oversized, size: 65536}
  - {at_s: 0, for_s: 1, kind: http_refused}
  - {at_s: 0, count: 1, kind: http_charset, utf16: true}
  - {at_s: 0, count: 1, kind: http_missing_tag, tag: cfgcpf}
  - {at_s: 0, count: 1, kind: http_duplicate_tag, tag: cfgcpf}
  - {at_s: 0, count: 1, kind: tcp_split, size: 3}
  - {at_s: 0, for_s: 1, kind: tcp_merged, delay_s: 0.1}
  - {at_s: 0, count: 1, kind: tcp_short, size: 5}
  - {at_s: 0, for_s: 1, kind: jitter, mean_s: 0.0001, p: 0.01, spike_s: 0.005}
  - {at_s: 0, for_s: 1, kind: short_block, p: 0.5, records: 3}
  - {at_s: 0, kind: overrun, samples: 3}
  - {at_s: 0, kind: rate, rate_hz: 1000}
  - {at_s: 0, kind: zero_drift, axis: 2, amount: 0.5, tau_s: 30}
  - {at_s: 3, for_s: 9, kind: address, address: 127.0.0.2}
)",
                                          "f.yaml");
  std::set<FaultKind> kinds;
  for (const Fault& fault : script) kinds.insert(fault.kind);
  EXPECT_EQ(kinds.size(), all_fault_kinds().size());
  EXPECT_EQ(script[0].at, 1s);
  EXPECT_EQ(script[0].lasts, 2s);
  EXPECT_EQ(script[0].p, 0.1);
  EXPECT_EQ(script[0].burst, 3u);
  EXPECT_EQ(script[1].count, 5u);
  EXPECT_EQ(script[1].p, 1);
  EXPECT_TRUE(script[7].replaces);
  EXPECT_EQ(script[14].down, 800ms);
  EXPECT_TRUE(script[14].resume);
  EXPECT_EQ(script[18].ppm, -60);
  EXPECT_EQ(script[18].end(), kNever);
  EXPECT_EQ(script[19].bits, 0x80400000u);
  for (std::size_t i = 1; i < script.size(); ++i) EXPECT_NE(name_of(script[i].kind), "?");
}

TEST(FaultFile, MayBeEmpty) { EXPECT_TRUE(parse_faults("format: kphi-faults/1\nfaults: []\n", "f").empty()); }

TEST(FaultFile, ChoosesTheHabitsOfTheBox) {
  const auto habits = parse_habits(
      "format: kphi-faults/1\nfaults: []\nhabits: {bias_stops_stream: true, last_block: padded, "
      "rate_write: pauses, first_rdt_sequence: 0, array_separator: blank, ft_counts_samples: false}",
      "f");
  EXPECT_TRUE(habits.bias_stops_stream);
  EXPECT_EQ(habits.last_block, NetBoxHabits::LastBlock::padded);
  EXPECT_EQ(habits.rate_write, NetBoxHabits::RateWrite::pauses);
  EXPECT_EQ(habits.first_rdt_sequence, 0u);
  EXPECT_EQ(habits.array_separator, ' ');
  EXPECT_FALSE(habits.ft_counts_samples);
  EXPECT_TRUE(habits.bias_vector_survives) << "as it was";
}

TEST(FaultFile, RefusesHabitsThatABoxCannotHave) {
  const std::string head = "format: kphi-faults/1\nfaults: []\nhabits:\n  ";
  EXPECT_EQ(refusal(head + "last_block: lost\n"),
            "f.yaml:4:15: 'lost' is neither partial, padded nor dropped; mend it");
  EXPECT_EQ(refusal(head + "axia: maybe\n"), "f.yaml:4:9: 'maybe' is neither false nor true; mend it");
  EXPECT_EQ(refusal(head + "first_rdt_sequence: -1\n"), "f.yaml:4:23: -1 is outside 0 to 4294967295; mend it");
  EXPECT_EQ(refusal(head + "smokes: true\n").substr(0, 42), "f.yaml:4:11: no habit is called 'smokes'; ");
  EXPECT_NE(refusal(head + "axia: ''\n"), "accepted");
  EXPECT_NE(refusal(head + "axia: [true]\n"), "accepted");
}

TEST(FaultFile, SaysWhereAndWhat) {
  EXPECT_EQ(refusal(kHead + "  - {at_s: 1, for_s: 2, kind: loss, p: 1.5}\n"),
            "f.yaml:3:40: 1.5 is outside 0 to 1; mend this entry");
  EXPECT_EQ(refusal(kHead + "  - {at_s: 1, kind: loss}\n"), "f.yaml:3:5: loss needs for_s or count; mend this entry");
}

TEST(FaultFile, IsStrict) {
  for (const char* entry : {
           "{at_s: 1, for_s: 1, kind: lose}",
           "{at_s: 1, for_s: 1}",
           "{for_s: 1, kind: loss}",
           "{at_s: -1, for_s: 1, kind: loss}",
           "{at_s: 1, for_s: 1, kind: loss, depth: 2}",
           "{at_s: 1, for_s: 1, kind: loss, burst: 1.5}",
           "{at_s: 1, for_s: 1, kind: loss, p: high}",
           "{at_s: 1, for_s: 1, kind: loss, p: nan}",
           "{at_s: 1, for_s: 1, kind: loss, p: 0.1, p: 0.2}",
           "{at_s: 1, for_s: 1, kind: loss, p: [0.1]}",
           "{at_s: 1, for_s: 0, kind: loss}",
           "{at_s: 1, for_s: 1, kind: stolen}",
           "{at_s: 1, count: 1, kind: stall}",
           "{at_s: 1, for_s: 1, kind: gilbert, p_good_bad: 0.1}",
           "{at_s: 1, for_s: 1, kind: wrong_size, size: 72}",
           "{at_s: 1, for_s: 1, kind: status, bits: 0xg}",
           "{at_s: 1, count: 1, kind: http_missing_tag}",
           "{at_s: 1, count: 1, kind: http_missing_tag, tag: <a>}",
           "{at_s: 1, kind: address, address: 300.0.0.1}",
           "{at_s: 1, kind: overrun}",
           "loss",
       }) {
    EXPECT_EQ(refusal(kHead + "  - " + entry + "\n").substr(0, 9), "f.yaml:3:") << entry;
  }
  EXPECT_NE(refusal(kHead + "  - {at_s: 1, for_s: 1, kind: lose}\n").find("gilbert"), std::string::npos)
      << "names what there is";
  EXPECT_NE(refusal("faults: []\n"), "accepted");
  EXPECT_NE(refusal("format: kphi-bench/1\nfaults: []\n"), "accepted");
  EXPECT_NE(refusal("format: kphi-faults/1\n"), "accepted");
  EXPECT_NE(refusal("format: kphi-faults/1\nfaults: []\nmore: 1\n"), "accepted");
  EXPECT_NE(refusal("format: kphi-faults/1\nfaults: {}\n"), "accepted");
  EXPECT_NE(refusal("{"), "accepted");
  EXPECT_NE(refusal(""), "accepted");
}

}  // namespace
}  // namespace kphi::sim
