#include "drivers/supply/wire.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace kphi::supply {
namespace wire_test {

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
  for (const std::string query : {"?", "?baud", "?baud=9600&", "?baud=9600&baud=9600", "?slave=0", "?slave=255",
                                  "?slave=+1", "?parity=E", "?model=RD6099"})
    EXPECT_NE(refusal("modbus-rtu:/dev/ttyUSB0" + query), "accepted") << query;
  for (const char* uri : {"", "modbus-rtu:", "modbus-rtu:ttyUSB0", "modbus-rtu:/", "modbus:/dev/ttyUSB0",
                          "MODBUS-RTU:/dev/ttyUSB0", "modbus-rtu:/dev/tty USB0", "modbus-tcp:", "modbus-tcp::502",
                          "modbus-tcp:host:0", "modbus-tcp:host:65536", "modbus-tcp:host:502x",
                          "modbus-tcp:host:502?baud=9600", "modbus-tcp:[::1", "modbus-tcp:[::1]502", "scpi:host"}) {
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

TEST(SupplyModels, AreFoundByTheirId) {
  const RegisterMap& riden = *find_model("RD6006")->map;
  const auto name = [&](std::uint16_t id) {
    const Model* model = find_model(riden, id);
    return model == nullptr ? std::string("unknown") : std::string(model->name);
  };
  using Known = std::pair<std::uint16_t, const char*>;
  for (const auto& [id, model] :
       {Known{60061, "RD6006"}, Known{60062, "RD6006"}, Known{60065, "RD6006P"}, Known{60121, "RD6012"},
        Known{60125, "RD6012P"}, Known{60181, "RD6018"}, Known{60241, "RD6024"}, Known{60301, "RD6030"}})
    EXPECT_EQ(name(id), model);
  for (const int id : {0, 1200, 5005, 60059, 60066, 60130, 60299, 60310, 65535})
    EXPECT_EQ(name(static_cast<std::uint16_t>(id)), "unknown") << id;
}

TEST(SupplyModels, OfOneFamilyShareNoId) {
  std::set<std::pair<const RegisterMap*, unsigned>> seen;
  for (const Model& model : models()) {
    for (unsigned id = model.first_id; id <= model.last_id; ++id) {
      EXPECT_TRUE(seen.emplace(model.map, id).second) << model.name << " " << id;
    }
  }
}

TEST(SupplyModels, CountAllTheirSettingsIn16Bits) {
  for (const Model& model : models()) {
    EXPECT_LE(model.max_v * model.counts_per_v, 65535) << model.name;
    for (const CurrentRange& range : model.ranges) EXPECT_LE(range.max_a * range.counts_per_a, 65535) << model.name;
  }
}

TEST(SupplyModels, AskWhoTheyAreInAShapeOfItsOwn) {
  for (const RegisterMap* map : families()) {
    std::set<unsigned> others{1, map->thresholds.count};
    for (const Block& block : map->look) others.insert(block.count);
    EXPECT_FALSE(others.contains(map->identity.count)) << map->family;
  }
}

TEST(SupplyModels, NeverAskForMoreRegistersThanOneRequestMayHave) {
  for (const RegisterMap* map : families()) {
    const int most = map->family == "RD60xx" ? 125 : 32;
    for (const Block& block : map->look) EXPECT_LE(block.count, most) << map->family;
    EXPECT_LE(map->identity.count, most);
    EXPECT_LE(map->thresholds.count, most);
  }
}

TEST(SupplyModels, LetNobodyWriteCalibrationOrBootloader) {
  for (const RegisterMap* map : families()) {
    for (const int at :
         {+map->set_voltage, +map->current_limit, +map->output, +map->over_voltage, +map->over_current}) {
      EXPECT_FALSE((at >= 55 && at <= 62) || at >= 256) << map->family << " " << at;
    }
  }
}

/// The 6001 settings from 0.00 to 60.00 V, in every model's counts: cut off, 1.13 V and 286 others lose a hundredth.
TEST(SupplyCounts, AreTheNearestForEveryHundredthOfAVolt) {
  for (const Model& model : models()) {
    const int per_hundredth = static_cast<int>(std::lround(model.counts_per_v / 100));
    for (int hundredth = 0; hundredth <= 6000; ++hundredth) {
      const double volts = hundredth / 100.0;
      ASSERT_EQ(to_counts(volts, model.counts_per_v), hundredth * per_hundredth) << model.name << " " << volts;
    }
  }
}

TEST(SupplyCounts, AreTheNearestForEveryMilliampere) {
  for (const Model& model : models()) {
    for (const CurrentRange& range : model.ranges) {
      for (int count = 0; count <= static_cast<int>(range.max_a * range.counts_per_a); ++count) {
        ASSERT_EQ(to_counts(count / range.counts_per_a, range.counts_per_a), count) << model.name;
      }
    }
  }
}

TEST(SupplyCounts, FitOnlyWhatTheDeviceCanBeTold) {
  EXPECT_TRUE(fits(0, 100, 60));
  EXPECT_TRUE(fits(60, 100, 60));
  EXPECT_TRUE(fits(60.004, 100, 60));
  EXPECT_FALSE(fits(60.006, 100, 60));
  EXPECT_FALSE(fits(-0.01, 100, 60));
  EXPECT_FALSE(fits(66, 1000, 100)) << "more than 16 bits";
  EXPECT_FALSE(fits(std::nan(""), 100, 60));
  EXPECT_FALSE(fits(std::numeric_limits<double>::infinity(), 100, 60));
}

TEST(SupplyProtection, IsNamedByTheDevicesOwnCode) {
  const RegisterMap& riden = *find_model("RD6006")->map;
  const RegisterMap& hanmatek = *find_model("HM310P")->map;
  EXPECT_EQ(protection_of(riden, 0), SupplyProtection::none);
  EXPECT_EQ(protection_of(riden, 1), SupplyProtection::over_voltage);
  EXPECT_EQ(protection_of(riden, 2), SupplyProtection::over_current);
  EXPECT_EQ(protection_of(riden, 9), SupplyProtection::unknown);
  EXPECT_EQ(protection_of(*find_model("DPS5005")->map, 3), SupplyProtection::over_power);
  EXPECT_EQ(protection_of(hanmatek, 0), SupplyProtection::none);
  EXPECT_EQ(protection_of(hanmatek, 0b00010), SupplyProtection::over_current);
  EXPECT_EQ(protection_of(hanmatek, 0b01000), SupplyProtection::over_temperature);
  EXPECT_EQ(protection_of(hanmatek, 0b10000), SupplyProtection::short_circuit);
  EXPECT_EQ(protection_of(hanmatek, 0b100000), SupplyProtection::unknown);
}

TEST(OffWord, WritesZeroToTheOutputOfTheFamilyByFunctionSix) {
  using Wire = LastWord::Wire;
  const auto text = [](std::initializer_list<int> bytes) { return std::string(bytes.begin(), bytes.end()); };
  // A frame of the serial line ends with its CRC, low byte first (checked by a Modbus calculator).
  const LastWord rtu =
      off_word(parse_address("modbus-rtu:/dev/ttyUSB1?baud=115200&model=RD6006"), *find_model("RD6006")->map, "supply");
  EXPECT_EQ(rtu.wire, Wire::serial);
  EXPECT_EQ(rtu.where, "/dev/ttyUSB1");
  EXPECT_EQ(rtu.number, 115200u);
  EXPECT_EQ(rtu.bytes, text({1, 6, 0, 0x12, 0, 0, 0x29, 0xCF}));
  EXPECT_EQ(rtu.answer, text({1, 6, 0, 0x12, 0, 0})) << "an echo";

  const LastWord tcp = off_word(parse_address("modbus-tcp:192.168.1.20:502?slave=7"), *find_model("DPS5005")->map, "");
  EXPECT_EQ(tcp.wire, Wire::tcp);
  EXPECT_EQ(tcp.where, "192.168.1.20");
  EXPECT_EQ(tcp.number, 502u);
  EXPECT_EQ(tcp.bytes.substr(2), text({0, 0, 0, 6, 7, 6, 0, 9, 0, 0})) << "behind the transaction";
  EXPECT_EQ(tcp.answer, text({7, 6, 0, 9, 0, 0}));
}

}  // namespace wire_test
}  // namespace kphi::supply
