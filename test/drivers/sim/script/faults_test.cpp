#include "drivers/sim/script/faults.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <set>

#include "base/error.hpp"
#include "base/random.hpp"
#include "drivers/sim/input_files.hpp"
#include "drivers/sim/usb/function.hpp"
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

/// A row that reads under its name gives its kind, and kinds and names are one to one.
template <class Fault>
void expect_distinct(const FaultTable<Fault>& table) {
  std::set<std::string_view> names;
  std::set<decltype(Fault::kind)> kinds;
  for (const auto& row : table.rows()) {
    names.insert(row.name);
    kinds.insert(row.kind);
    EXPECT_EQ(table.name_of(row.kind), row.name);
  }
  EXPECT_EQ(names.size(), table.rows().size());
  EXPECT_EQ(kinds.size(), table.rows().size());
}

TEST(FaultTables, NameEveryKindOnce) {
  expect_distinct(load_cell_faults());
  expect_distinct(motor_faults());
  expect_distinct(supply_faults());
  expect_distinct(ambient_faults());
  EXPECT_EQ(motor_faults().rows().size(), static_cast<std::size_t>(kMotorFaultKinds));
}

TEST(MotorFaultFile, ReadsEveryKindAndLeavesTheLoadCellsAlone) {
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
  const MotorFaultScript script = parse_faults(text, "f.yaml").motor;
  EXPECT_EQ(parse_faults(text, "f.yaml").load_cell.size(), 1u);
  ASSERT_EQ(script.size(), static_cast<std::size_t>(kMotorFaultKinds));
  std::set<MotorFaultKind> kinds;
  for (const MotorFault& fault : script) {
    kinds.insert(fault.kind);
    EXPECT_EQ(std::string(name_of(fault.kind)).rfind("motor_", 0), 0u);
    EXPECT_EQ(fault.at, 1s);
  }
  EXPECT_EQ(kinds.size(), script.size());
  EXPECT_EQ(script[0].bits, 3u);
  EXPECT_EQ(script[0].type, 50);
  EXPECT_EQ(script[0].sub, 13);
  EXPECT_EQ(script[0].end(), 3s);
  EXPECT_EQ(script[4].delay, 10ms);
  EXPECT_EQ(script[6].bytes, (std::vector<std::uint8_t>{0x55, 0x3b}));
  EXPECT_TRUE(std::isnan(script[11].value));
  EXPECT_TRUE(script[18].other);
  EXPECT_EQ(script[21].baud, 115200u);
}

TEST(SupplyFaults, AreReadFromAnEntry) {
  const SupplyFault late =
      supply_faults().read({{"kind", "supply_late"}, {"at_s", "1.5"}, {"for_s", "2"}, {"delay_s", "0.55"}});
  EXPECT_EQ(late.kind, SupplyFaultKind::late);
  EXPECT_EQ(late.at, 1500ms);
  EXPECT_EQ(late.end(), 3500ms);
  EXPECT_EQ(late.delay, 550ms);
  const SupplyFault panel =
      supply_faults().read({{"kind", "supply_panel"}, {"at_s", "1"}, {"register", "8"}, {"value", "1100"}});
  EXPECT_EQ(panel.address, 8);
  EXPECT_EQ(panel.value, 1100);
  const SupplyFault crc =
      supply_faults().read({{"kind", "supply_bad_crc"}, {"at_s", "0"}, {"count", "3"}, {"p", "0.5"}});
  EXPECT_EQ(crc.count, 3u);
  EXPECT_EQ(crc.p, 0.5);
  EXPECT_EQ(crc.end(), kNever);
  EXPECT_EQ(supply_faults().read({{"kind", "supply_sag"}, {"at_s", "1"}, {"for_s", "1"}, {"volts", "4.5"}}).volts, 4.5);
}

TEST(UsbFaults, AreReadFromAnEntry) {
  const UsbFault late =
      ambient_faults().read({{"kind", "ambient_late"}, {"at_s", "2"}, {"count", "3"}, {"delay_s", "0.55"}});
  EXPECT_EQ(late.kind, UsbFaultKind::late);
  EXPECT_EQ(late.at, 2s);
  EXPECT_EQ(late.count, 3u);
  EXPECT_EQ(late.delay, 550ms);
  const UsbFault byte = ambient_faults().read(
      {{"kind", "ambient_reads_as"}, {"at_s", "0"}, {"for_s", "1"}, {"register", "137"}, {"value", "106"}});
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
  const FaultFile file = parse_faults(text, "f.yaml");
  EXPECT_EQ(file.load_cell.size(), 1u);
  EXPECT_EQ(file.motor.size(), 1u);
  ASSERT_EQ(file.air.size(), 1u);
  EXPECT_EQ(file.air[0].kind, UsbFaultKind::nack);
  const SupplyFaultScript& script = file.supply;
  ASSERT_EQ(script.size(), 1u);
  EXPECT_EQ(script[0].kind, SupplyFaultKind::trip);
  EXPECT_EQ(script[0].code, 2);
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
  UsbFaults faults(clock, {UsbFault{{UsbFaultKind::nack, 1s, 1s, 0}}, UsbFault{{UsbFaultKind::busy, 0s, 0s, 2}}});
  EXPECT_FALSE(faults.strikes(UsbFaultKind::nack));
  EXPECT_TRUE(faults.strikes(UsbFaultKind::busy));
  EXPECT_TRUE(faults.active(UsbFaultKind::busy)) << "looking does not count";
  EXPECT_TRUE(faults.strikes(UsbFaultKind::busy));
  EXPECT_FALSE(faults.strikes(UsbFaultKind::busy));
  clock.set(1s);
  EXPECT_TRUE(faults.strikes(UsbFaultKind::nack));
  clock.set(2s);
  EXPECT_FALSE(faults.strikes(UsbFaultKind::nack));
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
      const UsbFault got = ambient_faults().read(fault);
      ++read;
      ASSERT_GE(got.at, 0s);
      ASSERT_EQ(ambient_faults().name_of(got.kind), fault["kind"]);
    } catch (const FaultEntryError&) {
    }
  }
  EXPECT_GT(read, 100);
}

}  // namespace
}  // namespace kphi::sim
