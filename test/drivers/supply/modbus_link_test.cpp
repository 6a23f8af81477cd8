#include "drivers/supply/modbus_link.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <modbus/modbus.h>
#include <termios.h>

#include <array>
#include <map>
#include <ostream>
#include <stdexcept>

#include "test/drivers/supply/scripted_slave.hpp"
#include "test/drivers/supply/simulated_supply.hpp"

namespace kphi::supply {
namespace modbus_link_test {

using namespace std::chrono_literals;
using sim::FaultKind;
using test::kShort;
using test::once;

Address on(const std::string& device) { return parse_address("modbus-rtu:" + device); }

/// Every frame that the sources give for a Riden, byte for byte.
TEST(ModbusLink, SpeaksTheFramesOfTheRiden) {
  test::ScriptedSlave slave({
      {"01 03 00 08 00 0D 05 CD",
       "01 03 1A 04 B0 13 88 04 AE 04 D2 00 00 05 C6 09 65 00 00 00 00 00 00 00 01 00 00 00 "
       "00 1E B6"},
      {"01 03 00 00 00 04 44 09", "01 03 08 EA 9E 00 00 12 67 00 80 D1 2E"},
      {"01 03 00 52 00 02 65 DA", "01 83 02 C0 F1"},
      {"01 03 00 08 00 01 05 C8", "01 03 02 04 B0 BB 30"},
      {"01 03 00 0A 00 01 A4 08", "01 03 02 04 AE 3B 38"},
      {"01 06 00 12 00 01 E8 0F", "01 06 00 12 00 01 E8 0F"},
      {"01 06 00 12 00 00 29 CF", "01 06 00 12 00 00 29 CF"},
      {"01 10 00 08 00 01 02 04 B0 A4 6C", "01 10 00 08 00 01 80 0B"},
  });
  ModbusLink link(on(slave.device()), {});
  ASSERT_TRUE(link.open().ok());
  RegisterImage image{};
  EXPECT_TRUE(link.read({8, 13}, image).ok());
  EXPECT_EQ(std::vector(image.begin() + 8, image.begin() + 21),
            (std::vector<std::uint16_t>{1200, 5000, 1198, 1234, 0, 1478, 2405, 0, 0, 0, 1, 0, 0}));
  const Outcome identified = link.read({0, 4}, image);
  EXPECT_TRUE(identified.ok()) << identified.words;
  EXPECT_EQ(image[0], 60062);
  const Outcome refused = link.read({82, 2}, image);
  EXPECT_EQ(refused.failure, Failure::refused);
  EXPECT_EQ(refused.words, "the device answers \"Illegal data address\"");
  EXPECT_TRUE(link.read({8, 1}, image).ok());
  EXPECT_EQ(image[8], 1200);
  EXPECT_TRUE(link.read({10, 1}, image).ok());
  EXPECT_EQ(image[10], 1198);
  EXPECT_TRUE(link.write(18, 1, false).ok());
  EXPECT_TRUE(link.write(18, 0, false).ok());
  EXPECT_TRUE(link.write(8, 1200, true).ok());
  EXPECT_EQ(slave.surprise(), "");
}

/// The trap that known_baud() and the look at the port exist for.
TEST(ModbusLink, LibmodbusRunsAt9600WhenItDoesNotKnowTheRate) {
  serial::fake::PseudoTerminal line;
  modbus_t* context = modbus_new_rtu(line.name().c_str(), 12345, 'N', 8, 1);
  ASSERT_NE(context, nullptr);
  EXPECT_EQ(modbus_connect(context), 0);
  EXPECT_EQ(cfgetospeed(std::array{line.line()}.data()), speed_t{B9600});
  modbus_close(context);
  modbus_free(context);
}

TEST(ModbusLink, DoesNotTalkAtThatRate) {
  serial::fake::PseudoTerminal line;
  Address address = on(line.name());
  for (const unsigned baud : {12345u, 250000u, 2000000u}) {
    address.baud = baud;
    EXPECT_EQ(ModbusLink(address, {}).open().words, fmt::format("the port does not accept {} baud", baud));
  }
}

TEST(ModbusLink, SetsEveryRateThatItKnows) {
  const std::map<unsigned, speed_t> speeds{{1200, B1200},     {2400, B2400},     {4800, B4800},    {9600, B9600},
                                           {19200, B19200},   {38400, B38400},   {57600, B57600},  {115200, B115200},
                                           {230400, B230400}, {460800, B460800}, {921600, B921600}};
  for (const auto& [baud, speed] : speeds) {
    serial::fake::PseudoTerminal line;
    Address address = on(line.name());
    address.baud = baud;
    ASSERT_TRUE(known_baud(baud));
    ModbusLink link(address, {});
    const Outcome opened = link.open();
    EXPECT_TRUE(opened.ok()) << baud << " " << opened.words;
    EXPECT_EQ(cfgetospeed(std::array{line.line()}.data()), speed) << baud;
  }
}

TEST(ModbusLink, TakesThePortForItself) {
  serial::fake::PseudoTerminal line;
  ModbusLink first(on(line.name()), {});
  ASSERT_TRUE(first.open().ok());
  ModbusLink second(on(line.name()), {});
  const Outcome refused = second.open();
  EXPECT_EQ(refused.failure, Failure::lost);
  EXPECT_FALSE(refused.words.empty());
  EXPECT_TRUE(first.open().ok()) << "anew, by its owner";
}

TEST(ModbusLink, NamesWhatIsNoSerialPort) {
  EXPECT_EQ(ModbusLink(on("/dev/no-such-port"), {}).open().words, "No such file or directory");
  EXPECT_EQ(ModbusLink(on("/dev/null"), {}).open().failure, Failure::lost);
}

class OnASupply : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(link.open().ok()); }
  test::SimulatedSupply supply;
  ModbusLink link{supply.address(), kShort};
  RegisterImage image{};
};

/// The trap that falling silent and the question who answers exist for: without them this is what happens.
TEST_F(OnASupply, WouldTakeALateAnswerForTheAnswerToTheNextRequest) {
  supply.inspect([](sim::SupplySlave& slave) {
    slave.registers().write(8, 1200);
    slave.registers().write(9, 5000);
  });
  supply.spoil(once(FaultKind::supply_late, kShort.answer + 50ms));
  EXPECT_EQ(link.read({8, 1}, image).failure, Failure::timeout);
  EXPECT_TRUE(link.read({9, 1}, image).ok());
  EXPECT_EQ(image[9], 1200) << "the voltage that was asked for first, in the place of the current";

  link.fall_silent();
  EXPECT_TRUE(link.read({9, 1}, image).ok());
  EXPECT_EQ(image[9], 5000);
}

/// An answer that begins late and takes its time: silence is waited for until its end.
TEST_F(OnASupply, WaitsForTheEndOfALateAnswer) {
  supply.spoil(once(FaultKind::supply_late, kShort.answer + 30ms));
  supply.spoil(once(FaultKind::supply_dribble, 5ms));
  EXPECT_EQ(link.read({8, 13}, image).failure, Failure::timeout);
  link.fall_silent();
  const Outcome settled = link.read({8, 13}, image);
  EXPECT_TRUE(settled.ok()) << settled.words;
}

struct Row {
  const char* name;
  sim::Fault fault;
  Failure expected;
  bool next_succeeds;  ///< the following request, without a flush between
};

void PrintTo(const Row& row, std::ostream* out) { *out << row.name; }

/// The table of faults, as libmodbus 3.1.6 reports each: what the driver is built upon.
class ModbusLinkMeets : public OnASupply, public testing::WithParamInterface<Row> {};

TEST_P(ModbusLinkMeets, AsLibmodbusReportsIt) {
  ASSERT_TRUE(link.read({8, 13}, image).ok());
  supply.spoil(GetParam().fault);
  const Outcome spoilt = link.read({8, 13}, image);
  EXPECT_EQ(spoilt.failure, GetParam().expected) << spoilt.words;
  const Outcome next = link.read({8, 13}, image);
  EXPECT_EQ(next.ok(), GetParam().next_succeeds) << next.words;
  link.fall_silent();
  const Outcome settled = link.read({8, 13}, image);
  EXPECT_TRUE(settled.ok()) << settled.words;
}

const Row kRows[] = {Row{"bad_crc", once(FaultKind::supply_bad_crc), Failure::damaged, true},
                     Row{"no_reply", once(FaultKind::supply_no_reply), Failure::timeout, true},
                     Row{"truncated", once(FaultKind::supply_truncated), Failure::timeout, true},
                     Row{"dribble", once(FaultKind::supply_dribble, 300us), Failure::none, true},
                     Row{"garbage", once(FaultKind::supply_garbage), Failure::damaged, false},
                     Row{"wrong_slave", once(FaultKind::supply_wrong_slave), Failure::damaged, true},
                     Row{"echo", once(FaultKind::supply_echo), Failure::damaged, false},
                     Row{"exception", once(FaultKind::supply_exception), Failure::refused, true}};
INSTANTIATE_TEST_SUITE_P(Faults, ModbusLinkMeets, testing::ValuesIn(kRows),
                         [](const auto& row) { return row.param.name; });

TEST_F(OnASupply, NeverSendsARequestForTooMany) {
  EXPECT_EQ(link.read({0, 126}, image).failure, Failure::refused);
  EXPECT_EQ(supply.truth().requests, 0u);
  EXPECT_THROW((void)link.read({120, 9}, image), std::logic_error);
}

TEST(ModbusLink, NoticesTheClosedPortAtOnce) {
  test::SimulatedSupply supply;
  ModbusLink link(supply.address(), Timing{10s, 10s, 60ms});
  ASSERT_TRUE(link.open().ok());
  RegisterImage image{};
  ASSERT_TRUE(link.read({8, 13}, image).ok());
  supply.spoil(test::lasting(FaultKind::supply_closed));
  EXPECT_TRUE(test::soon([&] { return link.read({8, 13}, image).failure == Failure::lost; }));
}

}  // namespace modbus_link_test
}  // namespace kphi::supply
