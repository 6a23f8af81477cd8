#include "daq/live/messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace kphi::daq::live {
namespace {

using nlohmann::json;

Subject subject() {
  profiles::Limits limits{from_rpm(19100), Newtons(20), Amperes(35), Celsius(110)};
  return {false, "icra", "5-inch three-blade", 19100, Seconds(0.3), limit_bars(limits)};
}

Tick full_tick() {
  Tick tick;
  tick.time_s = 12.34;
  tick.timestamp_s = 1622332812.34;
  tick.remaining_s = 372.4;
  tick.progress = 0.25;
  tick.occlusion_deg = 90;
  tick.repetition = 2;
  tick.repetitions = 3;
  tick.step = 16;
  tick.steps = 40;
  tick.commanded_rpm = 7895;
  tick.speed_rpm = 7893.6;
  tick.thrust_n = 1.1621;
  tick.torque_nm = 0.0123;
  tick.module_v = 11.9;
  tick.module_a = 3.2;
  tick.supply_v = 12;
  tick.supply_a = 3.3;
  tick.coil_degc = 41;
  tick.derate = 1;
  tick.received = 123456;
  tick.limit_values = {7893.6, 1.1621, 3.2, 41};
  write(tick.phase, "");
  write(tick.propeller, "5x3");
  return tick;
}

TEST(LiveMessages, OfATickCarryEveryNumberWithItsUnitInTheKey) {
  const json tick = json::parse(tick_message(full_tick(), 4, 0.01, 5));
  EXPECT_EQ(tick["type"], "tick");
  EXPECT_EQ(tick["thrust_n"], 1.1621);
  EXPECT_EQ(tick["speed_rpm"], 7893.6);
  EXPECT_EQ(tick["commanded_rpm"], 7895);
  EXPECT_EQ(tick["step"], 16);
  EXPECT_EQ(tick["propeller"], "5x3");
  EXPECT_EQ(tick["limits"], json({7893.6, 1.1621, 3.2, 41}));
  EXPECT_EQ(tick["dropped"], 5);
}

TEST(LiveMessages, SayNullForWhatIsUnknown) {
  const json tick = json::parse(tick_message(Tick{}, 0, 0, 0));
  for (const char* key : {"thrust_n", "speed_rpm", "torque_nm", "supply_v", "coil_degc"}) {
    EXPECT_TRUE(tick.at(key).is_null()) << key;
  }
}

TEST(LiveMessages, NameTheLimitsOnceInTheGreeting) {
  const json hello = json::parse(hello_message(subject()));
  EXPECT_EQ(hello["format"], "kphi-live/1");
  ASSERT_EQ(hello["limits"].size(), 4u);
  EXPECT_EQ(hello["limits"][1], (json{{"key", "thrust_n"}, {"name", "Thrust"}, {"unit", "N"}, {"limit", 20.0}}));
}

TEST(LiveMessages, SurviveWordsOfDevicesThatAreNoText) {
  const json line = json::parse(line_message(1, "motor: \xff\xfe \"</script>\" \x01"));
  EXPECT_NE(line["text"].get<std::string>().find("</script>"), std::string::npos);
}

TEST(PlotMessages, HaveATimestampAndNumbersOnly) {
  const json plot = json::parse(plot_message(full_tick(), subject().limits));
  EXPECT_EQ(plot["timestamp"], 1622332812.34);
  EXPECT_DOUBLE_EQ(plot["limit_share"]["thrust_n"].get<double>(), 0.058105);
  for (const auto& [key, value] : plot.items()) EXPECT_TRUE(value.is_number() || key == "limit_share") << key;
}

TEST(PlotMessages, LeaveOutWhatIsUnknown) {
  Tick tick;
  tick.limit_values[0] = kUnknown;
  const json plot = json::parse(plot_message(tick, subject().limits));
  EXPECT_FALSE(plot.contains("thrust_n"));
  EXPECT_FALSE(plot["limit_share"].contains("speed_rpm"));
  EXPECT_TRUE(plot["limit_share"].contains("thrust_n"));
}

TEST(PlotMessages, FitIntoOneDatagramOfPlotJuggler) {
  Tick tick = full_tick();
  tick.time_s = tick.thrust_n = tick.torque_nm = tick.speed_rpm = tick.commanded_rpm = -1.23456789e-301;
  tick.fault_bits = tick.received = tick.lost_network = tick.lost_host = ~std::uint64_t{0};
  std::vector<LimitBar> limits(kMostLimits, {"a_key_that_is_rather_long_a", "", "", 3, {}});
  for (std::size_t i = 0; i < limits.size(); ++i) limits[i].key += std::to_string(i);
  tick.limit_values.fill(-1.23456789e-301);
  EXPECT_LT(plot_message(tick, limits).size(), 1400u);
}

}  // namespace
}  // namespace kphi::daq::live
