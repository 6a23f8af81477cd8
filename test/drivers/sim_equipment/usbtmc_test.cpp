#include "test/drivers/sim_equipment/usbtmc.hpp"

#include <gmock/gmock.h>

#include "base/random.hpp"

namespace kphi::sim::usbtmc_test {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;
using Kind = UsbAnswer::Kind;

// The standard's example: "*IDN?\n" with tag 1, then a request of 1024 bytes with tag 2.
const Bytes kIdn{0x01, 0x01, 0xFE, 0, 6, 0, 0, 0, 1, 0, 0, 0, '*', 'I', 'D', 'N', '?', '\n', 0, 0};
const Bytes kAsk{0x02, 0x02, 0xFD, 0, 0x00, 0x04, 0, 0, 0, 0, 0, 0};

class SimulatedUsbtmcTest : public testing::Test {
 protected:
  UsbAnswer request(std::uint8_t type, std::uint8_t what, std::uint16_t value = 0, std::uint16_t length = 24) {
    return usb.control({type, what, value, 0, length}, {});
  }
  void clear() {
    (void)request(0xA1, 5, 0, 1);
    while (request(0xA1, 6, 0, 2).bytes.at(0) == 2) {
    }
    usb.halt_cleared(0x01);
  }

  ManualClock clock;
  UsbFaults faults{clock};
  ScpiInstrument instrument;
  Usbtmc usb{instrument, faults};
};

TEST_F(SimulatedUsbtmcTest, SaysWhatItCan) {
  const Bytes all = request(0xA1, 7).bytes;
  ASSERT_EQ(all.size(), 24u);
  EXPECT_EQ(all[0], 1);
  EXPECT_EQ(all[15], 0x0A) << "remote/local and SCPI";
}

TEST_F(SimulatedUsbtmcTest, AnswersTheExchangeOfTheStandard) {
  EXPECT_EQ(usb.out(0x01, kIdn).kind, Kind::bytes);
  EXPECT_EQ(usb.in(0x82, 512).kind, Kind::nothing_yet) << "nobody has asked for it";
  EXPECT_EQ(usb.out(0x01, kAsk).kind, Kind::bytes);
  const Bytes answer = usb.in(0x82, 512).bytes;
  ASSERT_EQ(answer.size(), 40u) << "12 + 25, padded to a multiple of four";
  EXPECT_EQ(Bytes(answer.begin(), answer.begin() + 12), (Bytes{2, 2, 0xFD, 0, 25, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_EQ(std::string(answer.begin() + 12, answer.begin() + 37), "KPHI,SIM3010,SN0001,1.00\n");
}

TEST_F(SimulatedUsbtmcTest, GivesAtMostWhatWasAskedForAndMarksTheEnd) {
  (void)usb.out(0x01, kIdn);
  Bytes ask = kAsk;
  ask[4] = 20, ask[5] = 0;
  (void)usb.out(0x01, ask);
  EXPECT_EQ(usb.in(0x82, 512).bytes[8], 0) << "more follows";
  (void)usb.out(0x01, ask);
  const Bytes rest = usb.in(0x82, 512).bytes;
  EXPECT_EQ(rest[4], 5);
  EXPECT_EQ(rest[8], 1);
}

TEST_F(SimulatedUsbtmcTest, HaltsOnWhatIsNoMessageUntilItIsCleared) {
  for (const auto& [at, value] :
       std::vector<std::pair<std::size_t, std::uint8_t>>{{0, 9}, {1, 0}, {2, 0xFD}, {3, 1}, {4, 0}, {4, 200}}) {
    Bytes wrong = kIdn;
    wrong[at] = value;
    EXPECT_EQ(usb.out(0x01, wrong).kind, Kind::stall) << at;
    EXPECT_EQ(usb.out(0x01, kIdn).kind, Kind::stall) << "still";
    usb.halt_cleared(0x01);
    EXPECT_EQ(usb.out(0x01, kIdn).kind, Kind::bytes);
  }
  EXPECT_EQ(usb.truth().malformed, 6u);
}

TEST_F(SimulatedUsbtmcTest, NotesAnAnswerThatNobodyFetched) {
  (void)usb.out(0x01, kIdn);
  (void)usb.out(0x01, kIdn);
  EXPECT_EQ(usb.truth().interrupted, 1u);
  EXPECT_EQ(instrument.state().errors.front().first, -410);
}

TEST_F(SimulatedUsbtmcTest, ForgetsAllWhenItIsCleared) {
  (void)usb.out(0x01, kIdn);
  (void)usb.out(0x01, kAsk);
  EXPECT_EQ(request(0xA1, 5, 0, 1).bytes, Bytes{1});
  EXPECT_EQ(usb.out(0x01, kIdn).kind, Kind::stall) << "until the host clears the halt";
  EXPECT_EQ(request(0xA1, 6, 0, 2).bytes[0], 2) << "pending";
  EXPECT_EQ(request(0xA1, 6, 0, 2).bytes[0], 1);
  usb.halt_cleared(0x01);
  (void)usb.out(0x01, kAsk);
  EXPECT_EQ(usb.in(0x82, 512).kind, Kind::nothing_yet);
}

TEST_F(SimulatedUsbtmcTest, AbortsOnlyTheTransferThatIsNamed) {
  (void)usb.out(0x01, kIdn);
  (void)usb.out(0x01, kAsk);
  EXPECT_EQ(request(0xA2, 3, 77, 2).bytes, (Bytes{0x81, 2}));
  EXPECT_EQ(request(0xA2, 3, 2, 2).bytes, (Bytes{0x01, 2}));
  EXPECT_EQ(usb.in(0x82, 512).kind, Kind::nothing_yet);
  EXPECT_EQ(request(0xA2, 4, 0, 8).bytes.size(), 8u);
  EXPECT_EQ(request(0xA2, 3, 2, 2).bytes[0], 0x80) << "nothing is under way any more";
}

TEST_F(SimulatedUsbtmcTest, ChokesOnRemoteControlIfItIsOfThatKind) {
  Usbtmc choker(instrument, faults, {0x1ab1, 0x0588, "DS1", true});
  (void)choker.control({0xA1, 160, 1, 0, 1}, {});
  (void)choker.out(0x01, kIdn);
  (void)choker.out(0x01, kAsk);
  EXPECT_EQ(choker.in(0x82, 512).kind, Kind::nothing_yet);
}

TEST_F(SimulatedUsbtmcTest, MisbehavesAsItIsTold) {
  const auto ask_with = [&](Fault fault) {
    clear();
    faults.set({fault});
    (void)usb.out(0x01, kIdn);
    (void)usb.out(0x01, kAsk);
    return usb.in(0x82, 512);
  };
  EXPECT_EQ(ask_with({FaultKind::usb_wrong_tag, {}, {}, 1}).bytes.at(1), 1);
  EXPECT_EQ(ask_with({FaultKind::ambient_no_reply, {}, {}, 1}).kind, Kind::nothing_yet);
  EXPECT_EQ(ask_with({FaultKind::ambient_stall, {}, {}, 1}).kind, Kind::stall);
  usb.halt_cleared(0x82);
  EXPECT_TRUE(ask_with({FaultKind::usb_empty_first, {}, {}, 1}).bytes.empty());
  EXPECT_EQ(usb.in(0x82, 512).bytes.size(), 40u);
  Fault fault{FaultKind::usb_packets, {}, {}, 1};
  fault.size = 16;
  EXPECT_EQ(ask_with(fault).bytes.size(), 16u);
  fault.kind = FaultKind::usb_parts;
  EXPECT_EQ(ask_with(fault).bytes.at(4), 16);
  fault.kind = FaultKind::ambient_late;
  fault.delay = 100ms;
  EXPECT_EQ(ask_with(fault).kind, Kind::nothing_yet);
  clock.advance(100ms);
  EXPECT_EQ(usb.in(0x82, 512).bytes.size(), 40u);
}

TEST_F(SimulatedUsbtmcTest, SurvivesAnyTransfersAndAnswersAgainOnceItIsCleared) {
  Random random(1);
  for (int i = 0; i < 100'000; ++i) {
    Bytes bytes = random.bits() % 3 == 0 ? Bytes(random.bits() % 40) : random.bits() % 2 == 0 ? kIdn : kAsk;
    for (std::uint8_t& byte : bytes)
      if (random.bits() % 8 == 0) byte = static_cast<std::uint8_t>(random.bits());
    (void)usb.out(0x01, bytes);
    (void)usb.in(0x82, random.bits() % 600);
    (void)request(random.bits() % 2 == 0 ? 0xA1 : 0xA2, static_cast<std::uint8_t>(random.bits() % 10),
                  static_cast<std::uint16_t>(random.bits() % 300), static_cast<std::uint16_t>(random.bits() % 30));
    if (random.bits() % 4 == 0) usb.halt_cleared(0x01);
    if (i % 1000 != 0) continue;
    clear();
    usb.halt_cleared(0x82);
    (void)usb.out(0x01, kIdn);
    (void)usb.out(0x01, kAsk);
    ASSERT_EQ(usb.in(0x82, 512).bytes.size(), 40u) << i;
  }
}

}  // namespace kphi::sim::usbtmc_test
