#include "drivers/sim/netbox/faults.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>

#include "base/error.hpp"
#include "drivers/sim/input_files.hpp"
#include "test/source_dir.hpp"

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;

std::string refusal(const std::string& text) {
  try {
    (void)parse_faults(text, "f.yaml");
  } catch (const ConfigurationError& error) {
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
  - {at_s: 5, kind: taken_over}
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
                                          "f.yaml")
                                 .load_cell;
  std::set<FaultKind> kinds;
  for (const Fault& fault : script) kinds.insert(fault.kind);
  EXPECT_EQ(kinds.size(), load_cell_faults().rows().size());
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

std::string readme() {
  std::ifstream file(kphi::test::source_dir() + "/README.md");
  return {std::istreambuf_iterator<char>(file), {}};
}

template <class Fault>
void expect_in_readme(const FaultTable<Fault>& table) {
  const std::string text = readme();
  for (const auto& row : table.rows())
    EXPECT_NE(text.find(fmt::format("`{}`", row.name)), std::string::npos) << row.name;
}

TEST(FaultTables, HaveEveryKindInTheReadme) {
  expect_in_readme(load_cell_faults());
  expect_in_readme(motor_faults());
  expect_in_readme(supply_faults());
  expect_in_readme(ambient_faults());
}

TEST(FaultFile, MayBeEmpty) { EXPECT_TRUE(parse_faults("format: kphi-faults/1\nfaults: []\n", "f").load_cell.empty()); }

TEST(FaultFile, ChoosesTheQuirksOfTheBox) {
  const auto quirks = parse_faults(
                          "format: kphi-faults/1\nfaults: []\nquirks: {bias_stops_stream: true, last_block: padded, "
                          "rate_write: pauses, array_separator: blank}",
                          "f")
                          .quirks;
  EXPECT_TRUE(quirks.bias_stops_stream);
  EXPECT_EQ(quirks.last_block, NetBoxQuirks::LastBlock::padded);
  EXPECT_EQ(quirks.rate_write, NetBoxQuirks::RateWrite::pauses);
  EXPECT_EQ(quirks.array_separator, ' ');
  EXPECT_TRUE(quirks.command_four_streams) << "as it was";
}

TEST(FaultFile, RefusesQuirksThatABoxCannotHave) {
  const std::string head = "format: kphi-faults/1\nfaults: []\nquirks:\n  ";
  EXPECT_EQ(refusal(head + "last_block: lost\n"),
            "f.yaml:4:15: \"lost\" is not one of partial, padded, dropped; fix this quirk");
  EXPECT_EQ(refusal(head + "axia: maybe\n"), "f.yaml:4:9: \"maybe\" is not one of false, true; fix this quirk");
  EXPECT_EQ(refusal(head + "smokes: true\n").substr(0, 37), "f.yaml:4:11: unknown quirk \"smokes\"; ");
  EXPECT_NE(refusal(head + "axia: ''\n"), "accepted");
  EXPECT_NE(refusal(head + "axia: [true]\n"), "accepted");
}

TEST(FaultFile, SaysWhereAndWhat) {
  EXPECT_EQ(refusal(kHead + "  - {at_s: 1, for_s: 2, kind: loss, p: 1.5}\n"),
            "f.yaml:3:40: 1.5 is outside 0 to 1; fix this entry");
  EXPECT_EQ(refusal(kHead + "  - {at_s: 1, kind: loss}\n"), "f.yaml:3:5: loss needs for_s or count; fix this entry");
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
           "{at_s: 1, for_s: 1, kind: taken_over}",
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
