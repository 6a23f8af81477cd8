#include "daq/live/history.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace kphi::daq::live {
namespace {

using nlohmann::json;
using testing::ElementsAre;

std::vector<std::string> types(const History& history) {
  std::vector<std::string> found;
  const json message = json::parse(history.message());
  for (const json& each : message["messages"]) found.push_back(each["type"]);
  return found;
}

Tick tick_at(double time_s) {
  Tick tick;
  tick.time_s = time_s;
  tick.thrust_n = 2.5;
  tick.speed_rpm = std::numeric_limits<double>::quiet_NaN();
  return tick;
}

TEST(History, KeepsStepsAndLinesInTheirOrderAndTheNewestLimitsAlone) {
  History history;
  history.keep({Message::Kind::limits, R"({"type":"limits","n":1})"});
  history.keep({Message::Kind::other, R"({"type":"line"})"});
  history.keep({Message::Kind::step, R"({"type":"step"})"});
  history.keep({Message::Kind::limits, R"({"type":"limits","n":2})"});
  EXPECT_THAT(types(history), ElementsAre("limits", "step", "line"));
  EXPECT_EQ(json::parse(history.message())["messages"][0]["n"], 2);
}

TEST(History, KeepsOnePointForEachTimeAndWritesNullForWhatIsNotKnown) {
  History history;
  history.keep(tick_at(1));
  history.keep(tick_at(1));
  history.keep(tick_at(1.05));
  const json trace = json::parse(history.message())["trace"];
  ASSERT_EQ(trace.size(), 2u);
  EXPECT_EQ(trace[0][1], 2.5);
  EXPECT_TRUE(trace[0][3].is_null());
}

TEST(History, ForgetsTheOldestWhenItIsFull) {
  History history;
  for (std::size_t i = 0; i < 2 * History::kTraceLength; ++i) {
    history.keep(tick_at(static_cast<double>(i)));
    history.keep({Message::Kind::other, R"({"type":"line","n":)" + std::to_string(i) + "}"});
  }
  const json message = json::parse(history.message());
  EXPECT_EQ(message["trace"].size(), History::kTraceLength);
  EXPECT_EQ(message["trace"].back()[0], 2.0 * History::kTraceLength - 1);
  EXPECT_EQ(message["messages"].size(), History::kMostLines);
  EXPECT_EQ(message["messages"].back()["n"], 2 * History::kTraceLength - 1);
}

}  // namespace
}  // namespace kphi::daq::live
