#include "drivers/sim/script/faults.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <set>

#include "base/error.hpp"
#include "base/random.hpp"
#include "drivers/sim/input_files.hpp"
#include "drivers/sim/usb/function.hpp"
#include "test/drivers/sim/fault_words.hpp"
#include "test/source_dir.hpp"

namespace kphi::sim::faults_test {

using namespace std::chrono_literals;
using test::fault;

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
  - {at_s: 0, kind: frozen, axes: 63}
  - {at_s: 0, kind: rate, rate_hz: 1000}
  - {at_s: 0, kind: zero_drift, axis: 2, amount: 0.5, tau_s: 30}
  - {at_s: 3, for_s: 9, kind: address, address: 127.0.0.2}
)",
                                          "f.yaml")
                                 .faults;
  std::set<FaultKind> kinds;
  for (const Fault& fault : script) kinds.insert(fault.kind);
  EXPECT_EQ(kinds.size(), static_cast<std::size_t>(FaultKind::motor_flip));
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
  std::ifstream file(kphi::test::source_dir() + "/drivers/sim/README.md");
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(FaultKinds, HaveEachItsNameWhichStandsInTheReadme) {
  const std::string text = readme();
  std::set<std::string_view> names;
  for (std::size_t i = 0; i <= static_cast<std::size_t>(FaultKind::usb_closed); ++i) {
    const std::string_view name = name_of(static_cast<FaultKind>(i));
    if (static_cast<FaultKind>(i) >= FaultKind::usb_wrong_tag) {
      EXPECT_EQ(name, "?") << "no script can cause it";
      continue;
    }
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_NE(text.find(fmt::format("`{}`", name)), std::string::npos) << name;
  }
}

TEST(MotorFaults, ReadsEveryKindAndLeavesTheLoadCellsAlone) {
  const std::string text = kHead + R"(
  - {at_s: 1, for_s: 2, kind: motor_flip, p: 0.1, bits: 3, type: 50, sub: 13}
  - {at_s: 1, count: 2, kind: motor_bad_crc}
  - {at_s: 1, for_s: 2, kind: motor_drop}
  - {at_s: 1, for_s: 2, kind: motor_duplicate}
  - {at_s: 1, for_s: 2, kind: motor_reorder}
  - {at_s: 1, for_s: 2, kind: motor_truncate, size: 4}
  - {at_s: 1, for_s: 2, kind: motor_garbage, bytes: 55 3B}
  - {at_s: 1, for_s: 2, kind: motor_merge, delay_s: 0.02}
  - {at_s: 1, for_s: 2, kind: motor_split, delay_s: 0.001}
  - {at_s: 1, for_s: 2, kind: motor_stall, size: 3, delay_s: 0.05}
  - {at_s: 1, for_s: 2, kind: motor_delay, delay_s: 0.2, jitter_s: 0.1}
  - {at_s: 1, for_s: 2, kind: motor_value, value: nan}
  - {at_s: 1, for_s: 2, kind: motor_wrong_length, size: 2}
  - {at_s: 1, for_s: 2, kind: motor_wrong_id, id: 5}
  - {at_s: 1, for_s: 2, kind: motor_stuck}
  - {at_s: 1, for_s: 2, kind: loss, p: 0.1}
  - {at_s: 1, for_s: 2, kind: motor_mute}
  - {at_s: 1, for_s: 2, kind: motor_deaf}
  - {at_s: 1, for_s: 2, kind: motor_command_flip, p: 0.01}
  - {at_s: 1, for_s: 2, kind: motor_unplug, other: true}
  - {at_s: 1, kind: motor_brown_out, down_s: 0.2}
  - {at_s: 1, for_s: 2, kind: motor_ignore_sets}
  - {at_s: 1, kind: motor_baud}
  - {at_s: 1, for_s: 2, kind: motor_redline, speed_rad_s: 1000}
  - {at_s: 1, for_s: 2, kind: motor_hot, coil_celsius: 120}
  - {at_s: 1, for_s: 2, kind: motor_over_voltage, volts: 20}
  - {at_s: 1, for_s: 2, kind: motor_sag, volts: 4}
  - {at_s: 1, for_s: 2, kind: motor_locked}
)";
  FaultScript script = parse_faults(text, "f.yaml").faults;
  const auto is_other = [](const Fault& f) { return !within(f.kind, FaultKind::motor_flip, FaultKind::motor_locked); };
  EXPECT_EQ(std::erase_if(script, is_other), 1u);
  std::set<FaultKind> kinds;
  for (const Fault& fault : script) {
    kinds.insert(fault.kind);
    EXPECT_EQ(std::string(name_of(fault.kind)).rfind("motor_", 0), 0u);
    EXPECT_EQ(fault.at, 1s);
  }
  EXPECT_EQ(kinds.size(),
            static_cast<std::size_t>(FaultKind::motor_locked) + 1 - static_cast<std::size_t>(FaultKind::motor_flip));
  EXPECT_EQ(kinds.size(), script.size());
  EXPECT_EQ(script[0].bits, 3u);
  EXPECT_EQ(script[0].type, 50);
  EXPECT_EQ(script[0].sub, 13);
  EXPECT_EQ(script[0].end(), 3s);
  EXPECT_EQ(script[4].delay, 10ms);
  EXPECT_EQ(script[6].bytes, (std::vector<std::uint8_t>{0x55, 0x3b}));
  EXPECT_TRUE(std::isnan(script[11].reading));
  EXPECT_TRUE(script[18].other);
  EXPECT_EQ(script[21].baud, 115200u);
}

TEST(SupplyFaults, AreReadFromAnEntry) {
  const Fault late = fault("supply_late at_s=1.5 for_s=2 delay_s=0.55");
  EXPECT_EQ(late.kind, FaultKind::supply_late);
  EXPECT_EQ(late.at, 1500ms);
  EXPECT_EQ(late.end(), 3500ms);
  EXPECT_EQ(late.delay, 550ms);
  const Fault panel = fault("supply_panel at_s=1 register=8 value=1100");
  EXPECT_EQ(panel.address, 8);
  EXPECT_EQ(panel.value, 1100);
  const Fault crc = fault("supply_bad_crc at_s=0 count=3 p=0.5");
  EXPECT_EQ(crc.count, 3u);
  EXPECT_EQ(crc.p, 0.5);
  EXPECT_EQ(crc.end(), kNever);
  EXPECT_EQ(fault("supply_sag at_s=1 for_s=1 volts=4.5").volts, 4.5);
}

TEST(UsbFaults, AreReadFromAnEntry) {
  const Fault late = fault("ambient_late at_s=2 count=3 delay_s=0.55");
  EXPECT_EQ(late.kind, FaultKind::ambient_late);
  EXPECT_EQ(late.at, 2s);
  EXPECT_EQ(late.count, 3u);
  EXPECT_EQ(late.delay, 550ms);
  const Fault byte = fault("ambient_reads_as at_s=0 for_s=1 register=137 value=106");
  EXPECT_EQ(byte.address, 137);
  EXPECT_EQ(byte.value, 106);
  EXPECT_EQ(byte.end(), 1s);
}

TEST(FaultFile, HoldsTheFaultsOfAllDevices) {
  const std::string text =
      "format: kphi-faults/1\nfaults:\n"
      "  - {at_s: 1, kind: reboot, down_s: 1}\n"
      "  - {at_s: 2, kind: supply_trip, code: 2}\n"
      "  - {at_s: 3, kind: motor_locked, for_s: 1}\n"
      "  - {at_s: 4, kind: ambient_nack, count: 2}\n";
  const FaultScript script = parse_faults(text, "f.yaml").faults;
  ASSERT_EQ(script.size(), 4u);
  EXPECT_EQ(script[0].kind, FaultKind::reboot);
  EXPECT_EQ(script[1].kind, FaultKind::supply_trip);
  EXPECT_EQ(script[1].code, 2);
  EXPECT_EQ(script[2].kind, FaultKind::motor_locked);
  EXPECT_EQ(script[3].kind, FaultKind::ambient_nack);
}

TEST(FaultFile, MayBeEmpty) { EXPECT_TRUE(parse_faults("format: kphi-faults/1\nfaults: []\n", "f").faults.empty()); }

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
  EXPECT_FALSE(quirks.axia) << "as it was";
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
  constexpr std::pair<const char*, const char*> kCases[] = {
      {"{at_s: 1, for_s: 2, kind: loss, p: 1.5}", "3:40: 1.5 is outside 0 to 1"},
      {"{at_s: 1, kind: loss}", "3:5: loss needs for_s or count"},
      {"{at_s: 1, for_s: 2, kind: motor_drop, p: 1.5}", "3:46: 1.5 is outside 0 to 1"},
      {"{at_s: 1, kind: motor_drop}", "3:5: motor_drop needs for_s or count"},
      {"{at_s: 0}", "3:5: no kind given"},
      {"{count: 1, kind: supply_bad_crc}", "3:5: supply_bad_crc needs at_s"},
      {"{at_s: 0, count: 1, kind: supply_closed}", "3:22: supply_closed has no key \"count\""},
      {"{at_s: 0, count: 1, kind: supply_late}", "3:5: supply_late needs delay_s"},
      {"{at_s: 0, kind: supply_trip, code: 6}", "3:40: 6 is outside 1 to 5"},
      {"{at_s: 0, kind: supply_trip, code: 1.5}", "3:40: 1.5 is not a whole number"},
      {"{at_s: x, kind: supply_trip, code: 1}", "3:12: \"x\" is not a number"},
      {"{at_s: 0, kind: ambient_unplug}", "3:5: ambient_unplug needs for_s"},
      {"{at_s: 0, count: 1, kind: ambient_nack, delay_s: 1}", "3:54: ambient_nack has no key \"delay_s\""},
      {"{at_s: 0, count: 1, kind: ambient_reads_as, register: 256, value: 0}", "3:59: 256 is outside 0 to 255"},
      {"{at_s: 0, count: 1.5, kind: ambient_nack}", "3:22: 1.5 is not a whole number"},
  };
  for (const auto& [entry, what] : kCases)
    EXPECT_EQ(refusal(kHead + "  - " + entry + "\n"), fmt::format("f.yaml:{}; fix this entry", what));
}

TEST(FaultFile, NamesTheKindsThatThereAre) {
  constexpr std::pair<const char*, const char*> kCases[] = {{"lose", "gilbert"},
                                                            {"motor_dorp", "motor_brown_out"},
                                                            {"supply_tripp", "supply_panel"},
                                                            {"ambient_nak", "known: ambient_unplug, ambient_no_reply"}};
  for (const auto& [kind, named] : kCases)
    EXPECT_NE(refusal(kHead + "  - {at_s: 1, for_s: 1, kind: " + kind + "}\n").find(named), std::string::npos) << kind;
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
           "{for_s: 1, kind: motor_drop}",
           "{at_s: 1, for_s: 1, kind: motor_drop, bits: 2}",
           "{at_s: 1, kind: motor_mute}",
           "{at_s: 1, count: 1, kind: motor_mute}",
           "{at_s: 1, for_s: 1, kind: motor_brown_out}",
           "{at_s: 1, for_s: 1, kind: motor_truncate}",
           "{at_s: 1, for_s: 1, kind: motor_truncate, size: 2.5}",
           "{at_s: 1, for_s: 1, kind: motor_garbage, bytes: 5}",
           "{at_s: 1, for_s: 1, kind: motor_garbage, bytes: hello}",
           "{at_s: 1, for_s: 1, kind: motor_value, value: high}",
           "{at_s: 1, for_s: 1, kind: motor_wrong_id, id: 64}",
           "{at_s: 1, for_s: 1, kind: motor_sag}",
           "{at_s: nan, for_s: 1, kind: motor_drop}",
           "{at_s: nan, kind: supply_trip, code: 1}",
       }) {
    EXPECT_EQ(refusal(kHead + "  - " + entry + "\n").substr(0, 9), "f.yaml:3:") << entry;
  }
  EXPECT_NE(refusal("faults: []\n"), "accepted");
  EXPECT_NE(refusal("format: kphi-bench/1\nfaults: []\n"), "accepted");
  EXPECT_NE(refusal("format: kphi-faults/1\n"), "accepted");
  EXPECT_NE(refusal("format: kphi-faults/1\nfaults: []\nmore: 1\n"), "accepted");
  EXPECT_NE(refusal("format: kphi-faults/1\nfaults: {}\n"), "accepted");
  EXPECT_NE(refusal("{"), "accepted");
  EXPECT_NE(refusal(""), "accepted");
}

TEST(UsbFaults, StrikeInTheirWindowAndSoManyTimes) {
  ManualClock clock;
  UsbFaults faults(clock, {Fault{FaultKind::ambient_nack, 1s, 1s, 0}, Fault{FaultKind::ambient_busy, 0s, 0s, 2}});
  EXPECT_FALSE(faults.strikes(FaultKind::ambient_nack));
  EXPECT_TRUE(faults.strikes(FaultKind::ambient_busy));
  EXPECT_TRUE(faults.active(FaultKind::ambient_busy)) << "looking does not count";
  EXPECT_TRUE(faults.strikes(FaultKind::ambient_busy));
  EXPECT_FALSE(faults.strikes(FaultKind::ambient_busy));
  clock.set(1s);
  EXPECT_TRUE(faults.strikes(FaultKind::ambient_nack));
  clock.set(2s);
  EXPECT_FALSE(faults.strikes(FaultKind::ambient_nack));
}

TEST(UsbFaults, AreReadOrRefusedWhateverIsWritten) {
  Random random(1);
  const std::vector<std::string> keys{"kind", "at_s", "for_s", "count", "delay_s", "size", "register", "value", "p"};
  const std::vector<std::string> values{"ambient_nack",
                                        "ambient_late",
                                        "ambient_unplug",
                                        "ambient_reads_as",
                                        "ambient_busy",
                                        "0",
                                        "1",
                                        "-1",
                                        "1e9",
                                        "1e999",
                                        "nan",
                                        "",
                                        "0x10",
                                        "3.5"};
  int read = 0;
  for (int i = 0; i < 100'000; ++i) {
    FaultEntry fault{{"at_s", "1"}, {"kind", values[random.bits() % 5]}};
    for (std::uint64_t n = random.bits() % 6; n > 0; --n)
      fault[keys[random.bits() % keys.size()]] = values[random.bits() % values.size()];
    try {
      const Fault got = fault_of(fault);
      ++read;
      ASSERT_GE(got.at, 0s);
      ASSERT_EQ(name_of(got.kind), fault["kind"]);
    } catch (const FaultEntryError&) {
    }
  }
  EXPECT_GT(read, 100);
}

TEST(FaultNumbers, AreDecimalHexadecimalOrTruthValues) {
  EXPECT_EQ(fault_number("p", "0.25"), 0.25);
  EXPECT_EQ(fault_number("p", "-1e3"), -1000);
  EXPECT_EQ(fault_number("p", "0x1F"), 31);
  EXPECT_EQ(fault_number("p", "true"), 1);
  EXPECT_EQ(fault_number("p", "false"), 0);
}

TEST(FaultNumbers, NameTheKeyOfWhatIsNotOne) {
  for (const char* text : {"", "x", "1 s", "0x", "0xG", "nan", "inf", "1,5", "+1"}) {
    try {
      (void)fault_number("delay_s", text);
      ADD_FAILURE() << text;
    } catch (const FaultEntryError& error) {
      EXPECT_EQ(error.key, "delay_s") << text;
    }
  }
}

TEST(FaultNumbers, HaveClosedRangesAndMayBeWhole) {
  EXPECT_EQ(fault_number("n", "1", 1, 5, true), 1);
  EXPECT_EQ(fault_number("n", "5", 1, 5, true), 5);
  EXPECT_EQ(fault_number("n", "1.5", 1, 5, false), 1.5);
  EXPECT_THROW((void)fault_number("n", "1.5", 1, 5, true), FaultEntryError);
  EXPECT_THROW((void)fault_number("n", "0", 1, 5, false), FaultEntryError);
  EXPECT_THROW((void)fault_number("n", "6", 1, 5, false), FaultEntryError);
}

TEST(Faults, ActInTheirWindowAndThatManyTimes) {
  Fault fault{FaultKind::loss, 1s, 2s, 3};
  EXPECT_FALSE(fault.active(999ms));
  EXPECT_TRUE(fault.active(1s, 2));
  EXPECT_FALSE(fault.active(1s, 3));
  EXPECT_FALSE(fault.active(3s)) << "the end is open";
  fault.lasts = 0s;
  EXPECT_TRUE(fault.active(1000s));
  EXPECT_EQ(fault.end(), kNever);
}

}  // namespace kphi::sim::faults_test
