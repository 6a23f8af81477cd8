#include "drivers/sim/usb/mcp2221.hpp"

#include <gmock/gmock.h>

#include "base/random.hpp"

namespace kphi::sim::mcp2221_test {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;
using testing::ElementsAre;

class SimulatedMcp2221Test : public testing::Test {
 protected:
  Bytes told(Bytes command, Duration after = 2ms) {
    clock.advance(after);
    command.resize(64, 0);
    EXPECT_EQ(bridge.out(0x03, command).kind, UsbAnswer::Kind::bytes);
    const UsbAnswer answer = bridge.in(0x83, 64);
    return answer.kind == UsbAnswer::Kind::bytes ? answer.bytes : Bytes{};
  }
  Bytes beginning(const Bytes& answer, std::size_t count) {
    return {answer.begin(), answer.begin() + static_cast<std::ptrdiff_t>(count)};
  }
  void break_with(Fault fault) { faults.set({fault}); }

  ManualClock clock;
  UsbFaults faults{clock};
  Mcp2221 bridge{faults, "0001"};
};

TEST_F(SimulatedMcp2221Test, IsASerialPortAndAHumanInterfaceDevice) {
  EXPECT_EQ(bridge.shape().interfaces.size(), 3u);
  EXPECT_EQ(bridge.shape().interfaces[2].class_code, 0x03);
  EXPECT_EQ(bridge.shape().vendor, 0x04D8);
}

TEST_F(SimulatedMcp2221Test, AnswersTheFramesOfAnEightByteRead) {
  EXPECT_EQ(beginning(told({0x10, 0, 0, 0x20, 0x75}), 5), (Bytes{0x10, 0, 0, 0x20, 0x75}));
  EXPECT_EQ(beginning(told({0x94, 1, 0, 0xEC, 0xF7}), 2), (Bytes{0x94, 0}));
  EXPECT_EQ(told({0x10})[8], 0x45) << "written, no stop";
  EXPECT_EQ(beginning(told({0x93, 8, 0, 0xEC}), 2), (Bytes{0x93, 0}));
  EXPECT_EQ(beginning(told({0x40}), 12), (Bytes{0x40, 0, 0x55, 8, 0x80, 0, 0, 0x80, 0, 0, 0x80, 0}));
  EXPECT_EQ(told({0x10})[8], 0x00);
  EXPECT_EQ(bridge.truth().overlapped + bridge.truth().hasty + bridge.truth().malformed, 0u);
}

TEST_F(SimulatedMcp2221Test, TakesEitherFormOfAReadsAddress) {
  for (const std::uint8_t address : {std::uint8_t{0xEC}, std::uint8_t{0xED}}) {
    told({0x94, 1, 0, 0xEC, 0xD0});
    told({0x93, 1, 0, address});
    EXPECT_EQ(beginning(told({0x40}), 5), (Bytes{0x40, 0, 0x55, 1, 0x60}));
  }
}

TEST_F(SimulatedMcp2221Test, TakesItsTimeOnTheBus) {
  told({0x94, 1, 0, 0xEC, 0xF7});
  told({0x93, 60, 0, 0xEC});
  EXPECT_EQ(beginning(told({0x40}, 1ms), 4), (Bytes{0x40, 0, 0x01, 127})) << "61 bytes take 5.5 ms at 100 kHz";
  EXPECT_EQ(told({0x40}, 5ms)[3], 60);
}

TEST_F(SimulatedMcp2221Test, ShowsAMissingAcknowledgementOnlyAfterwards) {
  EXPECT_EQ(beginning(told({0x90, 1, 0, 0x80, 0xD0}), 2), (Bytes{0x90, 0})) << "the write itself seems to succeed";
  const Bytes status = told({0x10});
  EXPECT_EQ(status[8], 0x25);
  EXPECT_EQ(status[20], 0x40);
  EXPECT_EQ(beginning(told({0x90, 1, 0, 0xEC, 0xD0}), 3), (Bytes{0x90, 0x01, 0x25})) << "until it is cancelled";
  EXPECT_EQ(told({0x10, 0, 0, 0x20, 0x75})[3], 0x21);
  EXPECT_EQ(told({0x10, 0, 0x10})[8], 0x00);
  EXPECT_EQ(told({0x10, 0, 0, 0x20, 0x75})[3], 0x20);
}

TEST_F(SimulatedMcp2221Test, KnowsOneAnswerAtATime) {
  Bytes command(64, 0);
  command[0] = 0x10;
  clock.advance(2ms);
  (void)bridge.out(0x03, command);
  command[0] = 0x61;
  (void)bridge.out(0x03, command);
  EXPECT_EQ(bridge.truth().overlapped, 1u);
  EXPECT_EQ(bridge.out(0x03, command).kind, UsbAnswer::Kind::nothing_yet) << "a third one has to wait";
  EXPECT_EQ(bridge.in(0x83, 64).bytes[0], 0x10);
  EXPECT_EQ(bridge.in(0x83, 64).bytes[0], 0x61);
  EXPECT_EQ(bridge.in(0x83, 64).kind, UsbAnswer::Kind::nothing_yet);
}

TEST_F(SimulatedMcp2221Test, CountsWhoDoesNotGiveItAMillisecond) {
  told({0x10}, 2ms);
  told({0x10}, 100us);
  EXPECT_EQ(bridge.truth().hasty, 1u);
}

TEST_F(SimulatedMcp2221Test, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(beginning(told({0x77}), 2), (Bytes{0x77, 0x02}));
  EXPECT_EQ(bridge.out(0x03, Bytes(7, 0)).kind, UsbAnswer::Kind::bytes);
  EXPECT_EQ(bridge.truth().malformed, 1u);
}

TEST_F(SimulatedMcp2221Test, MisbehavesAsItIsTold) {
  break_with({FaultKind::ambient_nack, {}, {}, 1});
  told({0x90, 1, 0, 0xEC, 0xD0});
  EXPECT_EQ(told({0x10})[8], 0x25);
  told({0x10, 0, 0x10});

  break_with({FaultKind::ambient_busy, {}, {}, 1});
  EXPECT_EQ(told({0x10, 0, 0, 0x20, 0x75})[3], 0x21);
  EXPECT_EQ(told({0x10, 0, 0, 0x20, 0x75})[3], 0x20);

  break_with({FaultKind::ambient_stuck_bus, {}, {}, 1});
  told({0x90, 1, 0, 0xEC, 0xD0});
  EXPECT_EQ(told({0x10})[8], 0x12);
  told({0x10, 0, 0x10});

  Fault damage{FaultKind::ambient_reads_as, {}, {}, 1};
  damage.address = 0x89, damage.value = 0x6A;
  break_with(damage);
  told({0x94, 1, 0, 0xEC, 0x88});
  told({0x93, 2, 0, 0xEC});
  EXPECT_EQ(beginning(told({0x40}), 6), (Bytes{0x40, 0, 0x55, 2, 0x70, 0x6A})) << "T1 = 27504 = 6b70";

  break_with({FaultKind::ambient_no_reply, {}, {}, 1});
  EXPECT_TRUE(told({0x10}).empty());

  Fault late{FaultKind::ambient_late, {}, {}, 1};
  late.delay = 600ms;
  break_with(late);
  EXPECT_TRUE(told({0x10}).empty());
  clock.advance(600ms);
  EXPECT_EQ(bridge.in(0x83, 64).bytes[0], 0x10);

  break_with({FaultKind::ambient_stall, {}, {}, 1});
  EXPECT_TRUE(told({0x10}).empty());
  bridge.halt_cleared(0x83);
  EXPECT_EQ(bridge.in(0x83, 64).bytes[0], 0x10);
}

TEST_F(SimulatedMcp2221Test, AnswersAnyReportWithItsOwnCommandAndNeverMoreThanItHolds) {
  Random random(1);
  for (int i = 0; i < 50'000; ++i) {
    Bytes command(64);
    for (std::uint8_t& byte : command) byte = static_cast<std::uint8_t>(random.bits() & random.bits());
    constexpr std::uint8_t kKnown[] = {0x10, 0x40, 0x61, 0x90, 0x93, 0x94};
    if (random.bits() % 4 != 0) command[0] = kKnown[random.bits() % std::size(kKnown)];
    if (random.bits() % 2 != 0) command[3] = 0xEC;
    const Bytes answer = told(command, Duration(static_cast<std::int64_t>(random.bits() % 30'000'000)));
    ASSERT_EQ(answer.size(), 64u);
    ASSERT_EQ(answer[0], command[0]);
    ASSERT_TRUE(command[0] != 0x40 || answer[3] <= 60 || answer[3] == 127);
  }
}

TEST_F(SimulatedMcp2221Test, SurvivesPacketsOfAnyLength) {
  Random random(2);
  for (int i = 0; i < 20'000; ++i) {
    Bytes bytes(random.bits() % 130);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.bits());
    clock.advance(1ms);
    (void)bridge.out(static_cast<std::uint8_t>(random.bits() % 4), bytes);
    ASSERT_LE(bridge.in(0x83, random.bits() % 65).bytes.size(), 64u);
  }
}

}  // namespace kphi::sim::mcp2221_test
