#include "daq/bench/box.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace kphi::daq {
namespace box_test {

using testing::HasSubstr;

TEST(CalibrationPage, IsKeptVerbatim) {
  const CalibrationPage read =
      read_calibration_page([](const std::string& target) { return "<xml of=\"" + target + "\">\n"; }, 3);
  EXPECT_TRUE(read.findings.empty());
  const auto pages = nlohmann::json::parse(read.json);
  EXPECT_EQ(pages.size(), 1u);
  EXPECT_EQ(pages.at("netftcalapi.xml?index=3"), "<xml of=\"/netftcalapi.xml?index=3\">\n");
}

TEST(CalibrationPage, ThatDoesNotComeIsAFinding) {
  const auto refuse = [](const std::string&) -> std::string { throw DeviceError("Net Box", "GET", "no answer"); };
  const CalibrationPage read = read_calibration_page(refuse, 0);
  ASSERT_EQ(read.findings.size(), 1u);
  EXPECT_TRUE(nlohmann::json::parse(read.json).at("netftcalapi.xml?index=0").is_null());
}

netbox::ZeroMeasurement quiet() {
  netbox::ZeroMeasurement zero;
  zero.records = 3500;
  zero.standard_deviation = {0.015, 0.015, 0.025, 6e-4, 6e-4, 6e-4};
  return zero;
}

TEST(BoxBias, IsRefusedWhenAnAxisIsNoisy) {
  netbox::ZeroMeasurement zero = quiet();
  zero.mean = {3, -2, 40, 0.1, 0, 0};
  EXPECT_EQ(unrest(zero), std::nullopt) << "at rest, whatever the load";
  zero.standard_deviation[2] = 2.0;
  EXPECT_THAT(unrest(zero).value(), HasSubstr("Fz is noisy: standard deviation 2 N, limit 0.3 N"));
  zero = quiet();
  zero.standard_deviation[4] = 0.02;
  EXPECT_THAT(unrest(zero).value(), HasSubstr("Ty is noisy"));
  zero.standard_deviation[4] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(unrest(zero).value(), HasSubstr("Ty is noisy")) << "nobody knows: no rest";
}

TEST(BoxBias, IsRefusedWithoutSoundRecords) {
  EXPECT_THAT(unrest({}).value(), HasSubstr("no valid sample"));
  EXPECT_THAT(beyond_zero({}).value(), HasSubstr("no valid sample"));
}

TEST(BoxBias, HasWorkedWhenEveryAxisIsNearZero) {
  netbox::ZeroMeasurement zero = quiet();
  zero.mean = {0.01, -0.01, 0.049, 0.0019, 0, 0};
  EXPECT_EQ(beyond_zero(zero), std::nullopt);
  zero.mean[0] = -0.06;
  EXPECT_THAT(beyond_zero(zero).value(), HasSubstr("Fx is -0.06 N afterwards, limit 0.05 N"));
}

}  // namespace box_test
}  // namespace kphi::daq
