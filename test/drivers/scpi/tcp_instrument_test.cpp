// The driver of a supply over TCP, against a simulated instrument that shares no line with them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "base/random.hpp"
#include "drivers/scpi/scpi_supply.hpp"
#include "drivers/scpi/tcp.hpp"
#include "test/drivers/scpi/lent_line.hpp"
#include "test/drivers/sim_equipment/scpi_tcp.hpp"

namespace kphi::scpi {
namespace {

using namespace std::chrono_literals;
using sim::UsbFaultKind;
using testing::HasSubstr;

template <class Call>
std::string refusal(Call&& call) {
  try {
    call();
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

class TcpInstrumentTest : public testing::Test {
 protected:
  SteadyClock clock;
  sim::UsbFaults faults{clock};
  sim::ScpiInstrument instrument;
  sim::ScpiTcp server{instrument, faults};
  Tcp line{"127.0.0.1", server.port(), 200ms};
};

TEST_F(TcpInstrumentTest, IsASupply) {
  ScpiSupply supply(lend(line), clock);
  instrument.connect_load(6);
  const supply::Limits limits{Volts(12), Amperes(5), Volts(13.2), Amperes(6)};
  EXPECT_EQ(supply.apply(limits), limits);
  const supply::PoweredOutput output(supply);
  EXPECT_DOUBLE_EQ(supply.read().power_w(), 24);
}

TEST_F(TcpInstrumentTest, SpeaksTheDialectOfRigol) {
  sim::ScpiInstrument rigol({"RIGOL TECHNOLOGIES,DP832,DP8A1,1.0", sim::ScpiKind::supply, sim::ScpiFamily::rigol});
  const sim::ScpiTcp other(rigol, faults);
  Tcp there("127.0.0.1", other.port(), 200ms);
  ScpiSupply supply(lend(there), clock);
  rigol.connect_load(1);
  const supply::Limits limits{Volts(12), Amperes(5), Volts(13.2), Amperes(6)};
  EXPECT_EQ(supply.apply(limits), limits);
  const supply::PoweredOutput output(supply);
  EXPECT_EQ(supply.read().regulation, supply::Regulation::constant_current);
  (void)rigol.apply("OUTP:OCP:VAL 4");
  EXPECT_EQ(supply.read().protection, supply::Protection::over_current);
}

TEST_F(TcpInstrumentTest, GivesALateAnswerToNobody) {
  faults.set({{UsbFaultKind::late, {}, {}, 1, 400ms}});
  EXPECT_THAT(refusal([&] { (void)line.query("VOLT? MAX"); }), HasSubstr("no answer in time"));
  EXPECT_EQ(line.query("CURR? MAX"), "10.000");
}

TEST_F(TcpInstrumentTest, ConnectsAgainAfterSilenceAndAfterAnEnd) {
  for (const UsbFaultKind kind : {UsbFaultKind::no_reply, UsbFaultKind::closed}) {
    faults.set({{kind, {}, {}, 1}});
    EXPECT_NE(refusal([&] { (void)line.query("*IDN?"); }), "");
    EXPECT_EQ(line.query("*IDN?"), "KPHI,SIM3010,SN0001,1.00");
  }
  EXPECT_EQ(line.counters().recoveries, 2u);
}

TEST_F(TcpInstrumentTest, AnswersTrulyOrNotAtAllUnderAnyMixtureOfFaults) {
  Tcp fast("127.0.0.1", server.port(), 20ms);
  Random random(1);
  int answered = 0, failed = 0;
  for (int i = 0; i < 200; ++i) {
    constexpr UsbFaultKind kKinds[] = {UsbFaultKind::no_reply, UsbFaultKind::late, UsbFaultKind::closed};
    sim::UsbFault fault{kKinds[random.bits() % 3], {}, {}, 1};
    fault.delay = Duration(static_cast<std::int64_t>(random.bits() % 40'000'000));
    if (i % 3 == 0) faults.set({fault});
    const bool volts = random.bits() % 2 == 0;
    try {
      ASSERT_EQ(fast.query(volts ? "VOLT? MAX" : "CURR? MAX"), volts ? "30.000" : "10.000") << i;
      ++answered;
    } catch (const DeviceError&) {
      ++failed;
    }
  }
  EXPECT_GT(answered, 100);
  EXPECT_GT(failed, 20);
}

}  // namespace
}  // namespace kphi::scpi
