#include "drivers/ambient/source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace kphi::ambient {
namespace {

TEST(AmbientPlace, IsASensorOrUnknown) {
  EXPECT_EQ(std::get<UsbAddress>(source_of("usb:04d8:00dd")), (UsbAddress{0x04d8, 0x00dd, "", ""}));
  EXPECT_EQ(std::get<UsbAddress>(source_of("usb:04D8:00DD:0001AB")).serial, "0001AB");
  EXPECT_EQ(std::get<UsbAddress>(source_of("usb:04d8:00dd@1-1.4")).port_path, "1-1.4");
  EXPECT_TRUE(std::holds_alternative<Unknown>(source_of("unknown")));
}

TEST(AmbientPlace, RefusesWhatIsNoSensorOfTheAir) {
  for (const char* text : {"", "Unknown", "usb:04d8", "usb:0403:6001", "tcp:host:1", "usb:04d8:00de"})
    EXPECT_THROW((void)source_of(text), std::invalid_argument) << text;
}

TEST(AmbientPlace, OpensWhatWasWrittenByHand) {
  const auto air = open(Air{20, 1e5, 0.5, 0.5, 100, 0.05});
  EXPECT_EQ(air->read().temperature_c, 20);
  EXPECT_EQ(air->identity(), "values written by hand");
  EXPECT_THROW((void)open(Air{20, 0, 0.5, 0, 0, 0}), std::invalid_argument);
  EXPECT_EQ(open(Unknown{}), nullptr);
}

}  // namespace
}  // namespace kphi::ambient
