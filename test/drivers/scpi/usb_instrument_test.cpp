// The true libusb and the drivers of USBTMC and supply, against a simulated instrument that shares no line with
// them; each fault alone, then all together.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "base/random.hpp"
#include "drivers/scpi/line.hpp"
#include "drivers/scpi/scpi_supply.hpp"
#include "drivers/usb/bus.hpp"
#include "test/drivers/scpi/lent_line.hpp"
#include "test/drivers/sim_equipment/usbtmc.hpp"
#include "test/drivers/usb/virtual_bus.hpp"

namespace kphi::scpi {
namespace usb_instrument_test {

using namespace std::chrono_literals;
using sim::FaultKind;
using testing::HasSubstr;

class UsbInstrumentTest : public OnVirtualBus {
 protected:
  void SetUp() override {
    OnVirtualBus::SetUp();
    if (IsSkipped()) return;
    wire->plug(1, function);
    bus = std::make_unique<usb::Bus>();
    device = bus->open(UsbAddress::parse("usb:1209:5c91"));
  }
  void TearDown() override { EXPECT_EQ(function.truth().malformed, 0u) << "the class's rules are kept"; }
  std::string idn(Line& line) { return line.query("*IDN?"); }

  sim::ScpiInstrument instrument;
  sim::Usbtmc function{instrument, faults};
  std::unique_ptr<usb::Bus> bus;
  std::unique_ptr<usb::Transport> device;
  static constexpr const char* kIdentity = "KPHI,SIM3010,SN0001,1.00";
};

TEST_F(UsbInstrumentTest, IsClearedPutUnderRemoteControlAndAsked) {
  Usbtmc line(*device, 500ms);
  EXPECT_EQ(idn(line), kIdentity);
  EXPECT_EQ(function.truth().clears, 1u);
  EXPECT_EQ(function.truth().remote, 1u);
}

TEST_F(UsbInstrumentTest, IsASupplyWithItsLimitsAndProtections) {
  Usbtmc line(*device, 500ms);
  ScpiSupply supply(lend(line), clock);
  EXPECT_EQ(supply.identity().model, "SIM3010");
  EXPECT_EQ(supply.identity().voltage_max_v, 30);
  instrument.connect_load(6);
  const supply::Limits limits{Volts(12), Amperes(5), Volts(13.2), Amperes(6)};
  EXPECT_EQ(supply.apply(limits), limits);
  {
    supply::PoweredOutput output(supply);
    SupplyReading reading = supply.read();
    EXPECT_TRUE(reading.output);
    EXPECT_DOUBLE_EQ(reading.voltage_v, 12);
    EXPECT_DOUBLE_EQ(reading.current_a, 2);
    EXPECT_EQ(reading.regulation, SupplyRegulation::constant_voltage);
    instrument.connect_load(1);
    reading = supply.read();
    EXPECT_DOUBLE_EQ(reading.voltage_v, 5);
    EXPECT_EQ(reading.regulation, SupplyRegulation::constant_current);
    (void)instrument.apply("VOLT:PROT 3");
    reading = supply.read();
    EXPECT_EQ(reading.protection, SupplyProtection::over_voltage);
    EXPECT_FALSE(reading.output);
  }
  EXPECT_FALSE(instrument.state().output);
}

TEST_F(UsbInstrumentTest, BlamesACommandOnlyForItsOwnErrors) {
  (void)instrument.apply("FOO;BAR;VOLT 99");
  Usbtmc line(*device, 500ms);
  ScpiSupply supply(lend(line), clock);
  EXPECT_NO_THROW(supply.apply({Volts(12), Amperes(5), Volts(13.2), Amperes(6)}));
  instrument.note_error(-410, "Query INTERRUPTED");
  EXPECT_NO_THROW(supply.switch_off());
  EXPECT_THAT(refusal([&] {
                (void)supply.apply({Volts(32), Amperes(5), Volts(33), Amperes(6)});
              }),
              testing::AllOf(HasSubstr("VOLT 32"), HasSubstr("-222")));
}

TEST_F(UsbInstrumentTest, SurvivesAnEmptyFirstPacket) {
  Usbtmc line(*device, 500ms);
  break_with(FaultKind::usb_empty_first);
  EXPECT_EQ(idn(line), kIdentity);
}

TEST_F(UsbInstrumentTest, GathersPacketsAndParts) {
  Usbtmc line(*device, 500ms);
  for (const unsigned size : {16u, 64u}) {
    break_with(FaultKind::usb_packets, 1, {}, size);
    EXPECT_EQ(idn(line), kIdentity) << size;
  }
  for (const unsigned size : {1u, 7u, 24u, 25u}) {
    break_with(FaultKind::usb_parts, 1000, {}, size);
    EXPECT_EQ(idn(line), kIdentity) << size;
  }
}

TEST_F(UsbInstrumentTest, NeverTakesTheAnswerToAnotherRequestAndRecoversFromAStall) {
  Usbtmc line(*device, 500ms);
  for (const auto& [kind, words] :
       {std::pair{FaultKind::usb_wrong_tag, "another request"}, std::pair{FaultKind::ambient_stall, "stalled"}}) {
    break_with(kind);
    EXPECT_THAT(refusal([&] { (void)idn(line); }), HasSubstr(words));
    EXPECT_EQ(idn(line), kIdentity);
  }
}

TEST_F(UsbInstrumentTest, AbortsAfterSilence) {
  Usbtmc line(*device, 100ms);
  break_with(FaultKind::ambient_no_reply);
  EXPECT_THAT(refusal([&] { (void)idn(line); }), HasSubstr("no answer in time"));
  EXPECT_EQ(function.truth().aborts, 1u);
  EXPECT_EQ(idn(line), kIdentity);
}

TEST_F(UsbInstrumentTest, GivesALateAnswerToNobody) {
  Usbtmc line(*device, 100ms);
  break_with(FaultKind::ambient_late, 1, 400ms);
  EXPECT_THAT(refusal([&] { (void)line.query("VOLT? MAX"); }), HasSubstr("no answer in time"));
  EXPECT_EQ(line.query("CURR? MAX"), "10.000");
}

TEST_F(UsbInstrumentTest, GivesALateAnswerToNobodyEvenIfTheInstrumentIgnoresAborts) {
  Usbtmc line(*device, 100ms);
  faults.set({{FaultKind::ambient_late, {}, {}, 1, 400ms}, {FaultKind::usb_deaf_to_abort, {}, {}, 4}});
  EXPECT_NE(refusal([&] { (void)line.query("VOLT? MAX"); }), "");
  std::string answer;
  ASSERT_TRUE(soon([&] { return refusal([&] { answer = line.query("CURR? MAX"); }).empty(); }));
  EXPECT_EQ(answer, "10.000");
}

TEST_F(UsbInstrumentTest, SaysWhatItDoesNotKnow) {
  Usbtmc line(*device, 50ms);
  EXPECT_THAT(refusal([&] { (void)line.query("FOO?"); }), HasSubstr("check that the instrument knows this command"));
  EXPECT_EQ(idn(line), kIdentity);
}

TEST_F(UsbInstrumentTest, SendsNoRemoteControlToWhomItChokes) {
  sim::Usbtmc choker(instrument, faults, {0x1ab1, 0x0588, "DS1", true});
  wire->plug(2, choker);
  const auto other = bus->open(UsbAddress::parse("usb:1ab1:0588"));
  Usbtmc line(*other, 500ms);
  EXPECT_EQ(idn(line), kIdentity);
  EXPECT_EQ(choker.truth().remote, 0u);
}

TEST_F(UsbInstrumentTest, EndsAtOnceWhenItIsUnpluggedInTheMiddleAndComesBack) {
  {
    Usbtmc line(*device, 60'000ms);
    break_with(FaultKind::ambient_no_reply);
    auto failure = std::async(std::launch::async, [&] { return refusal([&] { (void)idn(line); }); });
    ASSERT_TRUE(soon([&] { return function.truth().requests > 0; }));
    wire->unplug(1);
    EXPECT_THAT(failure.get(), HasSubstr("unplugged"));
    EXPECT_THAT(refusal([&] { (void)idn(line); }), HasSubstr("unplugged"));
  }
  wire->plug(1, function);
  ASSERT_TRUE(soon([&] { return refusal([&] { device = bus->open(UsbAddress::parse("usb:1209:5c91")); }).empty(); }));
  Usbtmc line(*device, 500ms);
  EXPECT_EQ(idn(line), kIdentity);
}

TEST_F(UsbInstrumentTest, AnswersTrulyOrNotAtAllUnderAnyMixtureOfFaults) {
  Usbtmc line(*device, 25ms);
  constexpr FaultKind kKinds[] = {FaultKind::ambient_no_reply, FaultKind::ambient_late,     FaultKind::ambient_stall,
                                  FaultKind::usb_wrong_tag,    FaultKind::usb_packets,      FaultKind::usb_parts,
                                  FaultKind::usb_empty_first,  FaultKind::usb_deaf_to_abort};
  Random random(1);
  int answered = 0, failed = 0;
  for (int i = 0; i < 150; ++i) {
    if (i % 3 == 0) {
      sim::FaultScript script;
      for (std::uint64_t n = random.bits() % 3; n > 0; --n) {
        sim::Fault fault{kKinds[random.bits() % std::size(kKinds)], {}, {}, 1 + random.bits() % 2};
        fault.delay = Duration(static_cast<std::int64_t>(random.bits() % 60'000'000));
        fault.size = 4 * (1 + random.bits() % 8);
        script.push_back(fault);
      }
      faults.set(script);
    }
    const bool volts = random.bits() % 2 == 0;
    try {
      ASSERT_EQ(line.query(volts ? "VOLT? MAX" : "CURR? MAX"), volts ? "30.000" : "10.000") << i;
      ++answered;
    } catch (const DeviceError&) {
      ++failed;
    }
  }
  EXPECT_GT(answered, 60);
  EXPECT_GT(failed, 10);
}

}  // namespace usb_instrument_test
}  // namespace kphi::scpi
