#include "drivers/sim/iq/faults.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "base/error.hpp"
#include "drivers/sim/input_files.hpp"

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;

const std::string kHead = "format: kphi-faults/1\nfaults:\n";

std::string refusal(const std::string& text) {
  try {
    (void)parse_faults(text, "f.yaml");
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return "accepted";
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

TEST(MotorFaultFile, SaysWhereAndWhat) {
  EXPECT_EQ(refusal(kHead + "  - {at_s: 1, for_s: 2, kind: motor_drop, p: 1.5}\n"),
            "f.yaml:3:46: 1.5 is outside 0 to 1; fix this entry");
  EXPECT_EQ(refusal(kHead + "  - {at_s: 1, kind: motor_drop}\n"),
            "f.yaml:3:5: motor_drop needs for_s or count; fix this entry");
  EXPECT_NE(refusal(kHead + "  - {at_s: 1, kind: motor_dorp}\n").find("motor_brown_out"), std::string::npos)
      << "names what there is";
}

TEST(MotorFaultFile, IsStrict) {
  for (const char* entry : {
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
       }) {
    EXPECT_EQ(refusal(kHead + "  - " + entry + "\n").substr(0, 9), "f.yaml:3:") << entry;
  }
}

}  // namespace
}  // namespace kphi::sim
