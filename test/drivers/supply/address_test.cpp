#include "drivers/supply/address.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace kphi::supply {
namespace {

using testing::HasSubstr;

std::string refusal(const std::string& uri) {
  try {
    (void)parse_address(uri);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(SupplyAddress, NamesASerialPort) {
  const Address address = parse_address("modbus-rtu:/dev/ttyUSB1?baud=9600&slave=3&model=DPS5015");
  EXPECT_EQ(address.wire, Address::Wire::rtu);
  EXPECT_EQ(address.device, "/dev/ttyUSB1");
  EXPECT_EQ(address.baud, 9600u);
  EXPECT_EQ(address.slave, 3);
  EXPECT_EQ(address.model, "DPS5015");
  EXPECT_EQ(address.where(), "/dev/ttyUSB1");
}

TEST(SupplyAddress, LeavesTheUsualUnsaid) {
  const Address riden = parse_address("modbus-rtu:/dev/ttyUSB1");
  EXPECT_EQ(riden.baud, 115200u);
  EXPECT_EQ(riden.slave, 1);
  EXPECT_EQ(parse_address("modbus-rtu:/dev/ttyUSB1?model=HM310P").baud, 9600u);
  EXPECT_EQ(parse_address("modbus-rtu:/dev/ttyUSB1?model=HM310P&baud=115200").baud, 115200u);
  EXPECT_EQ(parse_address("modbus-tcp:psu.lab").tcp.port, 502u);
}

TEST(SupplyAddress, NamesAHost) {
  const Address address = parse_address("modbus-tcp:192.168.1.20:1502?slave=255&model=RD6006");
  EXPECT_EQ(address.wire, Address::Wire::tcp);
  EXPECT_EQ(address.tcp.host, "192.168.1.20");
  EXPECT_EQ(address.tcp.port, 1502u);
  EXPECT_EQ(address.slave, 255);
  EXPECT_EQ(address.where(), "192.168.1.20:1502");
  const Address six = parse_address("modbus-tcp:[fe80::1]:1502");
  EXPECT_EQ(six.tcp.host, "fe80::1");
  EXPECT_EQ(six.where(), "[fe80::1]:1502");
}

TEST(SupplyAddress, RefusesABaudRateThatLibmodbusWouldSilentlyReplace) {
  for (const char* rate : {"12345", "250000", "2000000", "0", "-9600", "9600.0", "", "115200 ", "99999999999"}) {
    EXPECT_NE(refusal(std::string("modbus-rtu:/dev/ttyUSB0?baud=") + rate), "accepted") << rate;
  }
  EXPECT_EQ(
      refusal("modbus-rtu:/dev/ttyUSB0?baud=12345"),
      "supply \"modbus-rtu:/dev/ttyUSB0?baud=12345\": \"12345\" is not a baud rate that can be set; use one of 1200, "
      "2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600");
}

TEST(SupplyAddress, IsStrict) {
  for (const char* uri : {"",
                          "modbus-rtu:",
                          "modbus-rtu:ttyUSB0",
                          "modbus-rtu:/",
                          "modbus:/dev/ttyUSB0",
                          "MODBUS-RTU:/dev/ttyUSB0",
                          "modbus-rtu:/dev/ttyUSB0?",
                          "modbus-rtu:/dev/ttyUSB0?baud",
                          "modbus-rtu:/dev/ttyUSB0?baud=9600&",
                          "modbus-rtu:/dev/ttyUSB0?baud=9600&baud=9600",
                          "modbus-rtu:/dev/ttyUSB0?slave=0",
                          "modbus-rtu:/dev/ttyUSB0?slave=255",
                          "modbus-rtu:/dev/ttyUSB0?slave=+1",
                          "modbus-rtu:/dev/ttyUSB0?parity=E",
                          "modbus-rtu:/dev/ttyUSB0?model=RD6030",
                          "modbus-rtu:/dev/tty USB0",
                          "modbus-tcp:",
                          "modbus-tcp::502",
                          "modbus-tcp:host:0",
                          "modbus-tcp:host:65536",
                          "modbus-tcp:host:502x",
                          "modbus-tcp:host:502?baud=9600",
                          "modbus-tcp:[::1",
                          "modbus-tcp:[::1]502",
                          "scpi:host"}) {
    EXPECT_NE(refusal(uri), "accepted") << uri;
  }
}

TEST(SupplyAddress, SaysWhatToWriteInstead) {
  for (const char* uri : {"", "modbus-rtu:ttyUSB0", "usb:1"}) {
    EXPECT_THAT(refusal(uri), HasSubstr("write modbus-rtu:/dev/ttyUSB0?baud=115200&slave=1 or modbus-tcp:"));
    EXPECT_EQ(refusal(uri).find('\n'), std::string::npos);
  }
  EXPECT_THAT(refusal("modbus-rtu:/dev/ttyUSB0?model=X"), HasSubstr("use one of RD6006, RD6006P, RD6012"));
}

}  // namespace
}  // namespace kphi::supply
