#include "drivers/usb/address.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace kphi::usb {
namespace {

TEST(UsbAddress, IsVendorAndProductThenSerialOrSocket) {
  EXPECT_EQ(Address::parse("usb:04d8:00dd"), (Address{0x04d8, 0x00dd, "", ""}));
  EXPECT_EQ(Address::parse("usb:04D8:00DD:0001AB"), (Address{0x04d8, 0x00dd, "0001AB", ""}));
  EXPECT_EQ(Address::parse("usb:1a86:7523@1-1.4"), (Address{0x1a86, 0x7523, "", "1-1.4"}));
  EXPECT_EQ(Address::parse("usb:1ab1:0588:DS:1@2-3"), (Address{0x1ab1, 0x0588, "DS:1", "2-3"}));
  for (const char* text : {"usb:04d8:00dd", "usb:04d8:00dd:0001AB", "usb:1a86:7523@1-1.4"})
    EXPECT_EQ(Address::parse(text).text(), text);
}

TEST(UsbAddress, RefusesAnythingElseAndShowsTheForm) {
  for (const char* text : {"", "usb:", "usb:4d8:dd", "usb:04d8", "usb:04d8:00dg", "usb:04d8:00dd:", "usb:04d8:00dd@",
                           "usb:04d8:00ddX", "04d8:00dd", "usb:-4d8:00dd"}) {
    try {
      (void)Address::parse(text);
      ADD_FAILURE() << text;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("usb:VENDOR:PRODUCT"), std::string::npos);
    }
  }
}

TEST(UsbAddress, FitsByWhatItNames) {
  const Listing one{0x04d8, 0x00dd, "0001AB", "1-1.4", true};
  EXPECT_TRUE(fits(Address::parse("usb:04d8:00dd"), one));
  EXPECT_TRUE(fits(Address::parse("usb:04d8:00dd:0001AB@1-1.4"), one));
  EXPECT_FALSE(fits(Address::parse("usb:04d8:00dd:0001AC"), one));
  EXPECT_FALSE(fits(Address::parse("usb:04d8:00dd@1-1"), one));
  EXPECT_FALSE(fits(Address::parse("usb:04d8:00de"), one));
}

}  // namespace
}  // namespace kphi::usb
