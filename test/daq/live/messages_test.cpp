#include "daq/live/messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

namespace kphi::daq::live {
namespace messages_test {

using nlohmann::json;

Subject subject() {
  return {false,
          "icra",
          "5-inch three-blade",
          19100,
          Seconds(0.3),
          {{Watched::thrust, "thrust", 20, "N", "campaign limits.thrust_max_n"},
           {Watched::speed, "speed", 20055, "RPM", "bench iq.speed_max_rpm"},
           {Watched::supply_voltage_low, "supply voltage", 5, "V", "device motor", true}}};
}

Tick full_tick() {
  Tick tick;
  tick.time_s = 12.34;
  tick.timestamp_s = 1622332812.34;
  tick.position.done = 0.25;
  tick.position = {{"5x3"}, 90, 2, 3, 16, 40, "ramp", from_rpm(7895), 372.4};
  tick.seen.speed_rad_s = from_rpm(7893.6).value();
  tick.seen.thrust_n = 1.1621;
  tick.seen.torque_nm = 0.0123;
  tick.seen.supply.time_ns = 1;
  tick.seen.supply.voltage_v = 12;
  tick.seen.supply.current_a = 3.3;
  tick.seen.account.received = 123456;
  tick.seen.judged[Watched::thrust] = 1.1621;
  tick.seen.judged[Watched::supply_voltage_low] = 11.9;
  tick.seen.judged[Watched::supply_current] = 3.2;
  tick.seen.judged[Watched::coil_temperature] = 41;
  return tick;
}

TEST(LiveMessages, OfATickCarryEveryNumberWithItsUnitInTheKey) {
  const json tick = json::parse(tick_message(full_tick(), 0.01, 5));
  const json told{{"type", "tick"},   {"thrust_n", 1.1621}, {"speed_rpm", 7893.6}, {"commanded_rpm", 7895},
                  {"module_v", 11.9}, {"module_a", 3.2},    {"supply_v", 12},      {"coil_degc", 41},
                  {"step", 16},       {"propeller", "5x3"}, {"dropped", 5},        {"phase", ""}};  // in a step
  for (const auto& [key, value] : told.items()) EXPECT_EQ(tick[key], value) << key;
  EXPECT_EQ(tick["watched"].size(), kWatchedCount);
  EXPECT_EQ(tick["watched"]["thrust_n"], 1.162) << "four digits";
  EXPECT_TRUE(tick["watched"]["fx_n"].is_null());
}

TEST(LiveMessages, SayNullForWhatIsUnknown) {
  Tick stale;
  stale.seen.load_cell_age = stale.seen.motor_age = std::chrono::seconds(1);
  const json tick = json::parse(tick_message(stale, 0, 0));
  for (const char* key : {"thrust_n", "speed_rpm", "torque_nm", "supply_v", "supply_a", "coil_degc", "derate"}) {
    EXPECT_TRUE(tick.at(key).is_null()) << key;
  }
}

TEST(LiveMessages, NameTheLimitsAndWhoSetThem) {
  const json hello = json::parse(hello_message(subject()));
  EXPECT_EQ(hello["format"], "kphi-live/2");
  ASSERT_EQ(hello["limits"].size(), 3u);
  EXPECT_EQ(hello["limits"][0], (json{{"key", "thrust_n"},
                                      {"name", "Thrust"},
                                      {"unit", "N"},
                                      {"limit", 20.0},
                                      {"lower", false},
                                      {"source", "campaign limits.thrust_max_n"}}));
  EXPECT_EQ(json::parse(limits_message(subject().limits).text)["limits"], hello["limits"]);
}

TEST(LiveMessages, SurviveWordsOfDevicesThatAreNoText) {
  const json line = json::parse(line_message(1, "motor: \xff\xfe \"</script>\" \x01").text);
  EXPECT_NE(line["text"].get<std::string>().find("</script>"), std::string::npos);
}

TEST(PlotMessages, HaveATimestampAndNumbersOnly) {
  const json plot = json::parse(plot_message(full_tick(), subject().limits));
  EXPECT_EQ(plot["timestamp"], 1622332812.34);
  EXPECT_DOUBLE_EQ(plot["limit_share"]["thrust_n"].get<double>(), 0.05811);
  EXPECT_DOUBLE_EQ(plot["limit_share"]["voltage_low_v"].get<double>(), 0.4202) << "5 V of 11.9 V";
  for (const auto& [key, value] : plot.items()) EXPECT_TRUE(value.is_number() || key == "limit_share") << key;
}

TEST(PlotMessages, LeaveOutWhatIsUnknown) {
  Tick tick;
  tick.seen.load_cell_age = std::chrono::seconds(1);
  tick.seen.judged[Watched::thrust] = 1;
  const json plot = json::parse(plot_message(tick, subject().limits));
  EXPECT_FALSE(plot.contains("thrust_n"));
  EXPECT_FALSE(plot["limit_share"].contains("speed_rpm"));
  EXPECT_TRUE(plot["limit_share"].contains("thrust_n"));
}

TEST(PlotMessages, FitIntoOneDatagramOfPlotJuggler) {
  Tick tick = full_tick();
  SampleAccount& account = tick.seen.account;
  tick.time_s = tick.seen.thrust_n = tick.seen.torque_nm = -1.23456789e-301;
  tick.seen.speed_rad_s = -1.23456789e-301;
  tick.position.commanded = RadPerSec(-1.23456789e-301);
  tick.seen.fault_bits = account.received = account.lost_network = account.lost_host = ~std::uint64_t{0};
  std::vector<GuardLimit> limits;
  for (std::size_t i = 0; i < kWatchedCount; ++i) limits.push_back({static_cast<Watched>(i), "", 3, "", ""});
  tick.seen.judged.values.fill(-1.23456789e-301);
  EXPECT_LT(plot_message(tick, limits).size(), 1400u);
}

}  // namespace messages_test
}  // namespace kphi::daq::live
