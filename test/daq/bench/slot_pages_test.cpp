#include "daq/bench/slot_pages.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace kphi::daq {
namespace {

TEST(SlotPages, HoldAllConfigurationsAndCalibrationsVerbatim) {
  const SlotPages read = read_slot_pages([](const std::string& target) { return "<xml of=\"" + target + "\">\n"; });
  EXPECT_TRUE(read.findings.empty());
  const auto pages = nlohmann::json::parse(read.json);
  EXPECT_EQ(pages.size(), 32u);
  EXPECT_EQ(pages.at("netftapi2.xml?index=0"), "<xml of=\"/netftapi2.xml?index=0\">\n");
  EXPECT_EQ(pages.at("netftcalapi.xml?index=15"), "<xml of=\"/netftcalapi.xml?index=15\">\n");
}

TEST(SlotPages, StopAtTheFirstThatDoesNotComeAndSaySo) {
  int asked = 0;
  const SlotPages read = read_slot_pages([&](const std::string&) -> std::string {
    if (++asked == 3) throw DeviceError("Net Box", "GET", "no answer");
    return "x";
  });
  EXPECT_EQ(asked, 3);
  ASSERT_EQ(read.findings.size(), 1u);
  const auto pages = nlohmann::json::parse(read.json);
  EXPECT_EQ(pages.at("netftapi2.xml?index=1"), "x");
  EXPECT_TRUE(pages.at("netftapi2.xml?index=2").is_null());
  EXPECT_TRUE(pages.at("netftcalapi.xml?index=0").is_null());
}

}  // namespace
}  // namespace kphi::daq
