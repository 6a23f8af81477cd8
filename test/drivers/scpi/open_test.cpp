#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "drivers/scpi/scpi_supply.hpp"
#include "test/drivers/sim_equipment/scpi_instrument.hpp"
#include "test/drivers/sim_equipment/scpi_tcp.hpp"

namespace kphi::scpi {
namespace open_test {

std::string refusal(const std::string& uri) {
  try {
    (void)open_line(uri);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ScpiAddress, DiffersFromAModbusAddress) {
  EXPECT_TRUE(is_scpi("scpi-tcp:psu.lab"));
  EXPECT_TRUE(is_scpi("scpi-usb:1ab1:0e11"));
  EXPECT_FALSE(is_scpi("modbus-tcp:psu.lab"));
  EXPECT_FALSE(is_scpi(""));
  EXPECT_FALSE(is_scpi("scpi-tcp"));
}

TEST(ScpiAddress, RefusesWhatNamesNoInstrument) {
  for (const char* uri : {"scpi-tcp:", "scpi-tcp::5025", "scpi-tcp:psu.lab:", "scpi-tcp:psu.lab:0",
                          "scpi-tcp:psu.lab:65536", "scpi-tcp:psu.lab:50x", "scpi-tcp:psu.lab?x=1"})
    EXPECT_THAT(refusal(uri), testing::HasSubstr("write scpi-tcp:HOST:5025")) << uri;
  EXPECT_NE(refusal("scpi-usb:1ab1"), "accepted");
  EXPECT_THAT(refusal("gpib:7"), testing::HasSubstr("unknown scheme \"gpib:\"; write scpi-tcp"));
}

TEST(ScpiAddress, OpensASupplyThatOwnsItsLine) {
  const SteadyClock clock;
  sim::UsbFaults faults{clock};
  sim::ScpiInstrument instrument;
  const sim::ScpiTcp server(instrument, faults);
  instrument.connect_load(6);
  const auto supply =
      std::make_unique<ScpiSupply>(open_line("scpi-tcp:127.0.0.1:" + std::to_string(server.port())), clock);
  EXPECT_EQ(supply->identity().model, "SIM3010");
  EXPECT_FALSE(supply->read().output);
  const supply::Limits limits{Volts(12), Amperes(5), Volts(13.2), Amperes(6)};
  EXPECT_EQ(supply->apply(limits), limits);
  {
    const supply::PoweredOutput output(*supply);
    EXPECT_DOUBLE_EQ(supply->read().current_a, 2);
    EXPECT_DOUBLE_EQ(supply->read().power_w(), 24);
  }
  EXPECT_FALSE(instrument.state().output);
}

}  // namespace open_test
}  // namespace kphi::scpi
