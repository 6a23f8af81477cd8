#include "drivers/sim/supply/slave.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "test/drivers/sim/hex.hpp"

namespace kphi::sim::slave_test {

using namespace std::chrono_literals;
using namespace test;

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

TEST(ModbusScanner, GoesOnAfterABadCrcAndAfterAFrameThatHasNoEnd) {
  for (const auto& [broken, next] : {std::pair{"01 03 00 08 00 0D 05 CE", 1ms}, std::pair{"01 03 00", 100ms}}) {
    ModbusScanner scanner(ModbusFraming::rtu);
    scanner.feed(bytes(broken), 0ms);
    EXPECT_FALSE(scanner.next()) << broken;
    scanner.feed(bytes("01 03 00 08 00 0D 05 CD"), next);
    EXPECT_TRUE(scanner.next()) << broken;
  }
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

/// As owners report of these supplies: a host that asks locks the keypad, and writing to register 15 does not free it.
TEST(SupplySlave, OfARidenLocksItsKeypadWhileItIsAskedAndNoWriteFreesIt) {
  SupplySettings settings;
  settings.faults = {{.kind = FaultKind::supply_key, .at = 1s, .count = 1},
                     {.kind = FaultKind::supply_key, .at = 3s, .count = 1},
                     {.kind = FaultKind::supply_key, .at = 9s, .count = 1}};
  SupplySlave slave(settings);
  const auto output_at = [&](Instant now) { return slave.advance({}, now), slave.circuit().output(); };
  const auto lock_read_at = [&](Instant now) {
    const std::vector<std::uint8_t> free{6, 0, 15, 0, 0}, ask{3, 0, 15, 0, 1};
    for (const auto& pdu : {free, ask})
      slave.receive(1, ModbusFraming::tcp, modbus_frame(ModbusFraming::tcp, 1, 1, pdu), now);
    SupplyReply reply;
    while (slave.next_reply(reply, now + 1s)) continue;
    return reply.bytes.back();
  };
  EXPECT_TRUE(output_at(2s)) << "nobody has asked it yet";
  EXPECT_EQ(lock_read_at(2500ms), 1);
  EXPECT_TRUE(output_at(4s)) << "the key is dead";
  EXPECT_EQ(slave.truth().dead_keys, 1u);
  EXPECT_FALSE(output_at(9s)) << "nobody has asked it for long";
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

class Asked {
 public:
  explicit Asked(SupplySettings settings = {}) : slave(fast(settings)) {}

  /// The reply to a request without its CRC, as a manual prints it, also without.
  std::string ask(const std::string& request) {
    auto adu = bytes(request);
    const unsigned crc = modbus_crc(adu);
    adu.push_back(static_cast<std::uint8_t>(crc));
    adu.push_back(static_cast<std::uint8_t>(crc >> 8));
    std::string reply = raw(adu);
    return reply.empty() ? reply : reply.substr(0, reply.size() - 6);
  }
  std::string raw(const std::vector<std::uint8_t>& adu) {
    now += 10ms;
    slave.receive(0, ModbusFraming::rtu, adu, now);
    std::vector<std::uint8_t> all;
    SupplyReply reply;
    while (slave.next_due() != kNever) {
      now = std::max(now, slave.next_due());
      while (slave.next_reply(reply, now)) all.insert(all.end(), reply.bytes.begin(), reply.bytes.end());
    }
    return hex(all);
  }
  void spoil(FaultKind kind, std::uint16_t address = 0, std::uint16_t value = 0) {
    Fault fault;
    fault.kind = kind;
    fault.at = now;
    fault.lasts = 1h;
    fault.address = address;
    fault.value = value;
    slave.add_fault(fault);
  }

  SupplySlave slave;
  Instant now{0};

 private:
  static SupplySettings fast(SupplySettings settings) {
    settings.replies_per_s = 0;
    return settings;
  }
};

SupplySettings of_model(const std::string& model) {
  SupplySettings settings;
  settings.model = model;
  return settings;
}

/// Byte for byte what is known of the device.
TEST(SimulatedRiden, AnswersInTheKnownFrames) {
  Asked supply;
  supply.slave.registers().write(8, 1200);
  supply.slave.registers().write(9, 5000);
  supply.spoil(FaultKind::supply_reads_as, 10, 1198);
  supply.spoil(FaultKind::supply_reads_as, 11, 1234);
  supply.spoil(FaultKind::supply_reads_as, 13, 1478);
  supply.spoil(FaultKind::supply_reads_as, 15, 0);  // these frames are of a keypad that is free
  EXPECT_EQ(supply.raw(bytes("01 06 00 12 00 01 E8 0F")), hex("01 06 00 12 00 01 E8 0F"));
  EXPECT_EQ(supply.raw(bytes("01 03 00 08 00 0D 05 CD")),
            hex("01 03 1A 04 B0 13 88 04 AE 04 D2 00 00 05 C6 09 65 00 00 00 00 00 00 00 01 00 00 00 00 1E B6"));
  EXPECT_EQ(supply.raw(bytes("01 03 00 08 00 01 05 C8")), hex("01 03 02 04 B0 BB 30"));
  EXPECT_EQ(supply.raw(bytes("01 03 00 0A 00 01 A4 08")), hex("01 03 02 04 AE 3B 38"));
  EXPECT_EQ(supply.raw(bytes("01 06 00 12 00 00 29 CF")), hex("01 06 00 12 00 00 29 CF"));
  EXPECT_EQ(supply.raw(bytes("01 10 00 08 00 01 02 04 B0 A4 6C")), hex("01 10 00 08 00 01 80 0B"));
}

TEST(SimulatedRiden, RefusesWhatItDoesNotHave) {
  Asked supply;
  const auto with_crc = supply.raw(bytes("01 03 00 78 00 01 04 13"));
  EXPECT_EQ(with_crc, hex("01 83 02 C0 F1"));
  EXPECT_EQ(supply.ask("01 04 00 08 00 01"), hex("01 84 01")) << "function";
  EXPECT_EQ(supply.ask("01 03 00 08 00 00"), hex("01 83 03")) << "none";
  EXPECT_EQ(supply.ask("01 03 00 08 00 7E"), hex("01 83 03")) << "too many";
  EXPECT_EQ(supply.ask("01 03 00 77 00 02"), hex("01 83 02")) << "across the end";
  EXPECT_EQ(supply.ask("01 06 00 00 00 01"), hex("01 86 02")) << "only to be read";
  EXPECT_EQ(supply.ask("01 10 00 08 00 02 02 04 B0"), hex("01 90 03")) << "byte count";
  EXPECT_EQ(supply.ask("02 03 00 08 00 01"), "") << "another's";
}

TEST(SimulatedRiden, LetsItselfBeReadInOneRequest) {
  Asked supply;
  EXPECT_EQ(supply.ask("01 03 00 00 00 54").substr(0, 9), hex("01 03 A8"));
}

TEST(SimulatedRiden, CountsEveryHarmfulWrite) {
  Asked supply;
  for (int at = 55; at <= 62; ++at) supply.slave.registers().write(static_cast<std::uint16_t>(at), 1);
  supply.slave.registers().write(256, 5633);
  EXPECT_EQ(supply.slave.registers().harmful_writes(), 9u);
}

TEST(SimulatedRiden, CountsInTheScaleOfItsModel) {
  const auto twelve = [](const std::string& model) {
    Asked supply(of_model(model));
    supply.slave.circuit().controls().volts = 12;
    supply.slave.circuit().controls().amps = 5;
    return std::pair(*supply.slave.registers().read(8), *supply.slave.registers().read(9));
  };
  EXPECT_EQ(twelve("RD6006"), std::pair(std::uint16_t{1200}, std::uint16_t{5000}));
  EXPECT_EQ(twelve("RD6006P"), std::pair(std::uint16_t{12000}, std::uint16_t{50000}));
  EXPECT_EQ(twelve("RD6012"), std::pair(std::uint16_t{1200}, std::uint16_t{500}));
  EXPECT_EQ(twelve("RD6024"), std::pair(std::uint16_t{1200}, std::uint16_t{500}));
  EXPECT_EQ(twelve("RD6012P"), std::pair(std::uint16_t{12000}, std::uint16_t{50000}));
}

TEST(SimulatedRiden, ChangesItsScaleWithTheRange) {
  Asked supply(of_model("RD6012P"));
  supply.slave.circuit().controls().amps = 5;
  EXPECT_EQ(supply.slave.registers().read(9), 50000);
  supply.slave.registers().write(20, 1);
  EXPECT_EQ(supply.slave.registers().read(9), 5000);
}

TEST(SimulatedRiden, HidesTheLiveThresholdsAfterAPreset) {
  Asked supply;
  supply.slave.registers().write(82, 1300);
  supply.slave.registers().write(83, 3000);
  supply.slave.registers().write(84 + 2, 2000);  // M1: OVP
  supply.slave.registers().write(19, 1);
  EXPECT_EQ(supply.slave.circuit().controls().over_volts, 20);
  EXPECT_EQ(supply.slave.registers().read(82), 1300);
  EXPECT_EQ(supply.slave.registers().read(19), 0);
}

TEST(SimulatedDps, TakesNoMoreThan32Registers) {
  Asked supply(of_model("DPS5005"));
  EXPECT_EQ(supply.ask("01 03 00 00 00 0D").substr(0, 9), hex("01 03 1A"));
  EXPECT_EQ(supply.ask("01 03 00 50 00 08").substr(0, 9), hex("01 03 10"));
  EXPECT_EQ(supply.ask("01 03 00 00 00 21"), hex("01 83 03"));
  EXPECT_EQ(supply.ask("01 03 00 0B 00 01"), hex("01 03 02 13 8D"));
  EXPECT_EQ(supply.ask("01 03 00 0D 00 01"), hex("01 83 02"));
}

TEST(SimulatedHanmatek, HasItsGaps) {
  Asked supply(of_model("HM310P"));
  EXPECT_EQ(supply.ask("01 03 00 01 00 05"), hex("01 03 0A 00 00 00 00 0B C2 4B 50 02 33"));
  EXPECT_EQ(supply.ask("01 03 00 01 00 06"), hex("01 83 02"));
  EXPECT_EQ(supply.ask("01 03 00 00 00 04"), hex("01 83 02"));
}

TEST(SimulatedHanmatek, TellsItsTripAsABit) {
  Asked supply(of_model("HM310P"));
  supply.slave.circuit().trip(SupplyProtection::over_temperature);
  EXPECT_EQ(supply.slave.registers().read(2), 0b1000);
}

TEST(SupplySlave, AnswersNoFasterThanItsFirmware) {
  SupplySettings settings;
  settings.replies_per_s = 10;
  SupplySlave slave(settings);
  const auto request = bytes("01 03 00 08 00 01 05 C8");
  std::vector<Instant> times;
  SupplyReply reply;
  for (int i = 0; i < 5; ++i) slave.receive(0, ModbusFraming::rtu, request, 1ms);
  while (slave.next_due() != kNever) {
    times.push_back(slave.next_due());
    EXPECT_FALSE(slave.next_reply(reply, times.back() - 1ns));
    EXPECT_TRUE(slave.next_reply(reply, times.back()));
  }
  ASSERT_EQ(times.size(), 5u);
  for (std::size_t i = 1; i < times.size(); ++i) EXPECT_EQ(times[i] - times[i - 1], 100ms);
}

TEST(SupplySlave, DelaysInOrder) {
  SupplySettings settings;
  settings.replies_per_s = 0;
  Fault late;
  late.kind = FaultKind::supply_late;
  late.count = 1;
  late.delay = 150ms;
  settings.faults = {late};
  SupplySlave slave(settings);
  slave.receive(0, ModbusFraming::rtu, bytes("01 03 00 08 00 01 05 C8"), 0ms);
  slave.receive(0, ModbusFraming::rtu, bytes("01 03 00 0A 00 01 A4 08"), 100ms);
  SupplyReply reply;
  EXPECT_FALSE(slave.next_reply(reply, 150ms));
  EXPECT_TRUE(slave.next_reply(reply, 151ms));
  EXPECT_TRUE(slave.next_reply(reply, 151ms));
}

TEST(SupplySlave, DribblesByteByByte) {
  SupplySettings settings;
  Fault slow;
  slow.kind = FaultKind::supply_dribble;
  slow.count = 1;
  slow.delay = 300us;
  settings.faults = {slow};
  SupplySlave slave(settings);
  slave.receive(0, ModbusFraming::rtu, bytes("01 03 00 08 00 01 05 C8"), 0ms);
  SupplyReply reply;
  std::size_t count = 0;
  for (Instant at = 1ms; slave.next_due() != kNever; at += 300us, ++count) {
    EXPECT_EQ(slave.next_due(), at);
    EXPECT_TRUE(slave.next_reply(reply, at));
    EXPECT_EQ(reply.bytes.size(), 1u);
  }
  EXPECT_EQ(count, 7u);
}

TEST(SupplySlave, AnswersOverTcpWithTheTransactionOfTheRequest) {
  SupplySlave slave({});
  slave.receive(4, ModbusFraming::tcp, bytes("12 34 00 00 00 06 01 03 00 00 00 01"), 0ms);
  SupplyReply reply;
  ASSERT_TRUE(slave.next_reply(reply, 1s));
  EXPECT_EQ(reply.client, 4);
  EXPECT_EQ(hex(reply.bytes), hex("12 34 00 00 00 05 01 03 02 EA 9E"));
  slave.receive(4, ModbusFraming::tcp, bytes("47 45 54 20 2F 20 48"), 1s);
  EXPECT_FALSE(slave.makes_sense(4));
  slave.forget(4);
  EXPECT_TRUE(slave.makes_sense(4));
}

TEST(SupplySlave, IsTheSameForTheSameSeed) {
  const auto play = [](std::uint64_t seed) {
    SupplySettings settings;
    settings.seed = seed;
    Fault crc;
    crc.kind = FaultKind::supply_bad_crc;
    crc.lasts = 1h;
    crc.p = 0.5;
    settings.faults = {crc};
    Asked supply(settings);
    std::string all;
    for (int i = 0; i < 50; ++i) all += supply.raw(bytes("01 03 00 08 00 01 05 C8"));
    return all;
  };
  EXPECT_EQ(play(1), play(1));
  EXPECT_NE(play(1), play(2));
}

TEST(SupplySlave, SurvivesAnyRequest) {
  std::mt19937_64 random(3);
  for (const SupplyModel& model : supply_models()) {
    SupplySettings settings = of_model(std::string(model.name));
    settings.replies_per_s = 0;
    SupplySlave slave(settings);
    for (int i = 0; i < 3000; ++i) {
      std::vector<std::uint8_t> pdu(1 + random() % 12);
      for (auto& byte : pdu) byte = static_cast<std::uint8_t>(random() % 3 == 0 ? random() : random() % 20);
      const int client = static_cast<int>(random() % 2);
      const auto framing = client == 0 ? ModbusFraming::rtu : ModbusFraming::tcp;
      const Instant now = Duration(i) * 1'000'000;
      slave.receive(client, framing, modbus_frame(framing, 1, 7, pdu), now);
      slave.advance({0, 0.1}, now);
      SupplyReply reply;
      while (slave.next_reply(reply, now)) ASSERT_LE(reply.bytes.size(), 260u);
    }
    EXPECT_GT(slave.truth().requests, 1000u);
  }
}

}  // namespace kphi::sim::slave_test
