#include "drivers/netbox/wire/status.hpp"

#include <gmock/gmock.h>

namespace kphi::netbox::status_test {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Status, OnlyZeroAndALatchedMonitorConditionAreHealthy) {
  EXPECT_TRUE(healthy(0));
  EXPECT_TRUE(healthy(0x80010000));
  EXPECT_FALSE(healthy(0x80000000));
  EXPECT_FALSE(healthy(0x00010000));
  for (unsigned bit = 0; bit < 31; ++bit) {
    EXPECT_FALSE(healthy(1u << bit)) << bit;
    EXPECT_FALSE(healthy(0x80000000u | 1u << bit) && bit != 16) << bit;
    EXPECT_FALSE(healthy(0x80010000u | 1u << bit) && bit != 16) << bit;
  }
}

TEST(Status, SaturationIsBit17) {
  EXPECT_TRUE(saturated(0x80020000));
  EXPECT_TRUE(saturated(0xffffffff));
  EXPECT_FALSE(saturated(0x80010000));
  EXPECT_FALSE(saturated(0x40000000));  // on an Ethernet Axia this is saturation
  EXPECT_FALSE(saturated(0));
}

TEST(Status, NamesWhatIsSetMostSignificantFirst) {
  EXPECT_THAT(names(0), IsEmpty());
  EXPECT_THAT(names(0x80010000), ElementsAre("monitor condition latched"));
  EXPECT_THAT(names(0x80020000), ElementsAre("transducer saturation or A/D error"));
  EXPECT_THAT(names(0xC0000004), ElementsAre("CPU or RAM error", "internal temperature error"));
  EXPECT_THAT(names(0x80000000), ElementsAre("error summary")) << "without a cause";
  EXPECT_THAT(names(0x00008001), ElementsAre("bit 15", "bit 0")) << "without a meaning";
}

TEST(Status, EveryBitOfTable17_1HasItsName) {
  const char* const table[31] = {"bit 0",
                                 "HTTP protocol failure",
                                 "internal temperature error",
                                 "reference voltage or power monitor error",
                                 "serial link data unavailable",
                                 "analog supply too low",
                                 "analog supply too high",
                                 "artificial analog ground out of range",
                                 "insufficient strain gage excitation current",
                                 "excessive strain gage excitation current",
                                 "analog board watchdog timeout",
                                 "serial flash (SPI) failure",
                                 "serial EEPROM (I2C) failure",
                                 "stack check error",
                                 "watchdog timeout",
                                 "bit 15",
                                 "monitor condition latched",
                                 "transducer saturation or A/D error",
                                 "DeviceNet failure",
                                 "EtherNet/IP failure",
                                 "RDT communication error",
                                 "CAN communication error",
                                 "network communication failure",
                                 "configuration incompatible with calibration",
                                 "settings validation error",
                                 "halted: configuration errors",
                                 "program memory verification error",
                                 "serial link communication error",
                                 "analog board error",
                                 "digital board error",
                                 "CPU or RAM error"};
  for (unsigned bit = 0; bit < 31; ++bit) EXPECT_THAT(names(1u << bit), ElementsAre(table[bit]));
}

TEST(Status, AnAxiasSaturationIsBit30AndItsGagesBit27) {
  EXPECT_TRUE(saturated(0xC0000000, Product::axia));
  EXPECT_TRUE(saturated(0x88000000, Product::axia));
  EXPECT_FALSE(saturated(0x80020000, Product::axia));
  EXPECT_FALSE(saturated(0x80010000, Product::axia));
}

TEST(Status, ANetBoxIsFaultyButForSaturationAndItsNetworks) {
  const auto of = [](std::uint32_t status) { return verdict_of(status, Product::net_box); };
  for (const std::uint32_t sound : {0u, 0x80010000u}) EXPECT_EQ(of(sound), StatusVerdict::sound);
  for (const std::uint32_t saturated : {0x80020000u, 0x80030000u, 0x80120000u})
    EXPECT_EQ(of(saturated), StatusVerdict::saturated) << saturated;
  for (unsigned bit = 0; bit < 31; ++bit) {
    if (bit == 16 || bit == 17) continue;
    const bool network = (bit >= 18 && bit <= 22) || bit == 1;
    EXPECT_EQ(of(0x80000000u | 1u << bit), network ? StatusVerdict::communication : StatusVerdict::faulty) << bit;
    EXPECT_EQ(of(0x80030000u | 1u << bit), network ? StatusVerdict::saturated : StatusVerdict::faulty) << bit;
  }
  EXPECT_EQ(of(0x80000000), StatusVerdict::faulty) << "an error that has no name";
  EXPECT_EQ(of(0x00010000), StatusVerdict::faulty) << "a latch without the summary is no word of a Net Box";
}

TEST(Status, AnAxiaIsFaultyButForItsOwnSaturation) {
  const auto of = [](std::uint32_t status) { return verdict_of(status, Product::axia); };
  for (const std::uint32_t sound : {0u, 0x80010000u}) EXPECT_EQ(of(sound), StatusVerdict::sound);
  for (const std::uint32_t saturated : {0xC0000000u, 0x88000000u, 0xC8010000u})
    EXPECT_EQ(of(saturated), StatusVerdict::saturated) << saturated;
  for (unsigned bit = 0; bit < 31; ++bit) {
    if (bit == 16 || bit == 27 || bit == 30) continue;
    EXPECT_EQ(of(0x80000000u | 1u << bit), StatusVerdict::faulty) << bit;
  }
}

TEST(Status, EveryBitOfTheAxiasMapHasItsName) {
  const std::pair<int, const char*> map[] = {{0, "temperature error"},
                                             {1, "supply voltage error"},
                                             {2, "broken gage"},
                                             {3, "busy with its memory, filter or calibration"},
                                             {5, "common error"},
                                             {7, "calibration not accessible"},
                                             {16, "monitor condition latched"},
                                             {27, "gage out of range"},
                                             {28, "simulated error"},
                                             {29, "calibration checksum error"},
                                             {30, "force or torque out of range"}};
  for (const auto& [bit, name] : map) EXPECT_THAT(names(1u << bit, Product::axia), ElementsAre(name));
  EXPECT_THAT(names(1u << 17, Product::axia), ElementsAre("bit 17"));
  EXPECT_THAT(names(1u << 31, Product::axia), ElementsAre("error summary"));
}

}  // namespace kphi::netbox::status_test
