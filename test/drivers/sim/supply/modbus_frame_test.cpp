#include "drivers/sim/supply/modbus_frame.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "test/drivers/sim/hex.hpp"

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;
using test::bytes;
using test::hex;

TEST(ModbusCrc, HasThePublishedCheckValue) {
  const std::string digits = "123456789";
  EXPECT_EQ(modbus_crc(std::vector<std::uint8_t>(digits.begin(), digits.end())), 0x4B37);
}

TEST(ModbusScanner, FindsARequestHoweverItIsCut) {
  const auto frame = bytes("01 03 00 08 00 0D 05 CD");
  for (std::size_t cut = 0; cut <= frame.size(); ++cut) {
    ModbusScanner scanner(ModbusFraming::rtu);
    scanner.feed(std::span(frame).first(cut), 0ms);
    if (cut < frame.size()) {
      EXPECT_FALSE(scanner.next()) << cut;
    }
    scanner.feed(std::span(frame).subspan(cut), 1ms);
    const auto request = scanner.next();
    ASSERT_TRUE(request) << cut;
    EXPECT_EQ(request->unit, 1);
    EXPECT_EQ(hex(request->pdu), hex("03 00 08 00 0D"));
    EXPECT_EQ(hex(request->adu), hex(frame));
  }
}

TEST(ModbusScanner, KnowsHowLongAWriteIs) {
  ModbusScanner scanner(ModbusFraming::rtu);
  scanner.feed(bytes("01 10 00 08 00 01 02 04 B0 A4 6C 01 06 00 12 00 01 E8 0F"), 0ms);
  EXPECT_EQ(hex(scanner.next()->pdu), hex("10 00 08 00 01 02 04 B0"));
  EXPECT_EQ(hex(scanner.next()->pdu), hex("06 00 12 00 01"));
  EXPECT_FALSE(scanner.next());
}

TEST(ModbusScanner, DropsAndCountsABadCrc) {
  ModbusScanner scanner(ModbusFraming::rtu);
  scanner.feed(bytes("01 03 00 08 00 0D 05 CE"), 0ms);
  EXPECT_FALSE(scanner.next());
  EXPECT_EQ(scanner.damaged(), 1u);
  scanner.feed(bytes("01 03 00 08 00 0D 05 CD"), 1ms);
  EXPECT_TRUE(scanner.next());
}

TEST(ModbusScanner, GivesUpAFrameThatHasNoEnd) {
  ModbusScanner scanner(ModbusFraming::rtu);
  scanner.feed(bytes("01 03 00"), 0ms);
  EXPECT_FALSE(scanner.next());
  scanner.feed(bytes("01 03 00 08 00 0D 05 CD"), 100ms);
  EXPECT_TRUE(scanner.next());
  EXPECT_EQ(scanner.damaged(), 1u);
}

TEST(ModbusScanner, ReadsTheHeaderOfTcp) {
  ModbusScanner scanner(ModbusFraming::tcp);
  scanner.feed(bytes("00 07 00 00 00 06 01 03 00 08 00 0D 00 08"), 0ms);
  const auto request = scanner.next();
  ASSERT_TRUE(request);
  EXPECT_EQ(request->transaction, 7);
  EXPECT_EQ(request->unit, 1);
  EXPECT_EQ(hex(request->pdu), hex("03 00 08 00 0D"));
  EXPECT_FALSE(scanner.next());
}

TEST(ModbusScanner, GivesUpAStreamThatIsNotModbus) {
  for (const char* header :
       {"00 01 00 01 00 06 01", "00 01 00 00 00 01 01", "00 01 00 00 01 00 01", "47 45 54 20 2F 20 48"}) {
    ModbusScanner scanner(ModbusFraming::tcp);
    scanner.feed(bytes(header), 0ms);
    EXPECT_FALSE(scanner.next());
    EXPECT_TRUE(scanner.broken()) << header;
  }
}

TEST(ModbusFrame, IsReadBackByTheScanner) {
  for (const ModbusFraming framing : {ModbusFraming::rtu, ModbusFraming::tcp}) {
    const auto frame = modbus_frame(framing, 3, 0x1234, bytes("06 00 12 00 01"));
    ModbusScanner scanner(framing);
    scanner.feed(frame, 0ms);
    const auto request = scanner.next();
    ASSERT_TRUE(request);
    EXPECT_EQ(request->unit, 3);
    EXPECT_EQ(hex(request->pdu), hex("06 00 12 00 01"));
  }
}

TEST(ModbusScanner, SurvivesAnything) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 20000; ++round) {
    ModbusScanner scanner(round % 2 == 0 ? ModbusFraming::rtu : ModbusFraming::tcp);
    std::vector<std::uint8_t> noise(random() % 40);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : random() % 17);
    for (int piece = 0; piece < 3; ++piece) {
      scanner.feed(noise, Duration(piece));
      while (const auto request = scanner.next()) ASSERT_FALSE(request->pdu.empty());
    }
  }
}

}  // namespace
}  // namespace kphi::sim
