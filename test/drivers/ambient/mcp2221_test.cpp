#include "drivers/ambient/mcp2221.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "test/drivers/ambient/fake_bridge.hpp"
#include "test/refusal.hpp"

namespace kphi::ambient {
namespace mcp2221_test {

using Bytes = std::vector<std::uint8_t>;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(Mcp2221, FreesTheBusAndSetsTheSpeedWhenItOpens) {
  FakeBridge usb;
  Mcp2221 bridge(usb, no_pause);
  EXPECT_TRUE(usb.claimed);
  EXPECT_THAT(usb.commands, ElementsAre(Bytes{0x61}, Bytes{0x10, 0, 0x10}, Bytes{0x10, 0, 0, 0x20, 0x75}));
}

class OpenMcp2221 : public testing::Test {
 protected:
  std::uint8_t chip_id() {
    std::array<std::uint8_t, 1> data{};
    bridge.read(0x76, 0xD0, data);
    return data[0];
  }
  FakeBridge usb;
  Mcp2221 bridge{usb, no_pause};
};

TEST_F(OpenMcp2221, ReadsARegisterInTheFramesOfTheManual) {
  usb.commands.clear();
  std::array<std::uint8_t, 8> data{};
  bridge.read(0x76, 0xF7, data);
  EXPECT_THAT(data, ElementsAre(0x80, 0, 0, 0x80, 0, 0, 0x80, 0));
  EXPECT_THAT(usb.commands,
              ElementsAre(Bytes{0x94, 1, 0, 0xEC, 0xF7}, Bytes{0x10}, Bytes{0x93, 8, 0, 0xEC}, Bytes{0x40}));
}

TEST_F(OpenMcp2221, GathersAReadingLongerThanOneReport) {
  for (int i = 0; i < 100; ++i) usb.registers[i] = static_cast<std::uint8_t>(i);
  std::array<std::uint8_t, 100> data{};
  bridge.read(0x76, 0, data);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(data[static_cast<std::size_t>(i)], i);
}

TEST_F(OpenMcp2221, SeesAMissingAcknowledgement) {
  std::array<std::uint8_t, 1> data{};
  EXPECT_THAT(refusal([&] { bridge.read(0x40, 0xD0, data); }), HasSubstr("no device answers at this address"));
  EXPECT_THAT(refusal([&] { bridge.write(0x40, data); }), HasSubstr("0x25"));
  EXPECT_EQ(chip_id(), 0x60) << "the bus is free again";
}

TEST_F(OpenMcp2221, AsksAgainWhileTheBridgeIsBusy) {
  usb.busy = 3;
  EXPECT_EQ(chip_id(), 0x60);
}

TEST_F(OpenMcp2221, NamesWhatKeepsItFromReading) {
  const auto refused = [&](std::uint8_t command, std::map<std::size_t, std::uint8_t> spoilt) {
    usb.spoil = [=](Bytes& answer) {
      for (const auto& [at, value] : spoilt) answer[at] = answer[0] == command ? value : answer[at];
      return false;
    };
    return refusal([&] { return chip_id(); });
  };
  EXPECT_THAT(refused(0x94, {{1, 1}, {2, 0x01}}), HasSubstr("busy")) << "for good";
  EXPECT_THAT(refused(0x10, {{8, 0x12}}), HasSubstr("held low"));
  EXPECT_THAT(refused(0x40, {{3, 60}}), HasSubstr("more bytes")) << "than it asked for";
  usb.next_write = usb::Outcome::gone;
  EXPECT_THAT(refused(0, {}), HasSubstr("unplugged"));
}

TEST(Mcp2221, PassesOverAnswersToAnotherCommand) {
  FakeBridge usb;
  usb.waiting.push_back(Bytes(64, 0x40));
  Mcp2221 bridge(usb, no_pause);
  usb.waiting.push_back(Bytes(64, 0x93));
  std::array<std::uint8_t, 1> data{};
  bridge.read(0x76, 0xD0, data);
  EXPECT_EQ(data[0], 0x60);
}

TEST(Mcp2221, CancelsATransferThatKeepsTheSpeedFromBeingSet) {
  FakeBridge usb;
  int busy = 1;
  usb.spoil = [&](Bytes& answer) {
    if (answer[3] == 0x20 && busy-- > 0) answer[3] = 0x21;
    return false;
  };
  Mcp2221 bridge(usb, no_pause);
  EXPECT_THAT(usb.commands, ElementsAre(Bytes{0x61}, Bytes{0x10, 0, 0x10}, Bytes{0x10, 0, 0, 0x20, 0x75},
                                        Bytes{0x10, 0, 0x10}, Bytes{0x10, 0, 0, 0x20, 0x75}));
}

}  // namespace mcp2221_test
}  // namespace kphi::ambient
