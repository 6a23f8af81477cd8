#include "daq/live/live_session.hpp"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "daq/live/feed.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq::live {
namespace live_session_test {

using nlohmann::json;
using testing::ElementsAre;

class Told final : public Progress {
 public:
  void guarded(const std::vector<GuardLimit>& all) override { limits = all.size(); }
  void tick(const Position&, const Observation&) override { ++ticks; }
  void step_done(const Position&, const Observation&) override { ++steps; }
  void say(const std::string& line) override { lines.push_back(line); }
  void asks(const StandQuestion& question) override { questions.push_back(question.text); }
  int ticks = 0, steps = 0;
  std::size_t limits = 0;
  std::vector<std::string> lines, questions;
};

class LiveProgressOf : public testing::Test {
 protected:
  /// Ticks every 10 ms for `duration` of step `step`.
  void hold(int step, Duration duration, double thrust_n, double rpm) {
    position_.step = step;
    position_.commanded = from_rpm(rpm);
    seen_.thrust_n = thrust_n;
    seen_.speed_rad_s = from_rpm(rpm).value();
    for (const Instant until = clock_.now() + duration; clock_.now() < until;) {
      clock_.advance(std::chrono::milliseconds(10));
      progress_.tick(position_, seen_);
    }
  }
  [[nodiscard]] double watched(Watched of) const { return feed_.newest().seen.judged[of]; }
  std::vector<json> messages() {
    std::vector<json> taken;
    feed_.take([&](const Message& message) { taken.push_back(json::parse(message.text)); });
    return taken;
  }

  Told told_;
  Feed feed_;
  ManualClock clock_;
  const Subject subject_ = subject_of(test::short_campaign(), test::deterministic_config(1));  // 0.3 s are discarded
  LiveProgress progress_{told_, feed_, nullptr, subject_, clock_};
  Position position_{{"5x3"}, 90, 2, 3, -1, 40, "zero", RadPerSec(0), 100};
  Observation seen_;
};

TEST_F(LiveProgressOf, TellsTheTerminalAllTheSameAndPassesOnWhatIsSaid) {
  hold(0, std::chrono::milliseconds(50), 1, 6000);
  progress_.say("load cell: it is silent");
  EXPECT_THAT(told_.lines, ElementsAre("load cell: it is silent"));
  const std::vector<json> told = messages();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0]["type"], "line");
  EXPECT_EQ(told[0]["text"], "load cell: it is silent");
  progress_.step_done(position_, seen_);
  EXPECT_EQ(told_.ticks, 5);
  EXPECT_EQ(told_.steps, 1);
}

TEST_F(LiveProgressOf, PassesOnWhatAPersonIsAsked) {
  progress_.asks({"Mount 45°, then type 45.", 45, 2, 5, false, "<svg/>"});
  progress_.asks({});
  const std::vector<json> told = messages();
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0], json({{"type", "ask"},
                           {"text", "Mount 45°, then type 45."},
                           {"occlusion_deg", 45.0},
                           {"repetition", 2},
                           {"run", 5},
                           {"repetition", 2},
                           {"run", 5},
                           {"has_power", false},
                           {"drawing", "<svg/>"}}));
  EXPECT_EQ(told[1], json({{"type", "ask"},
                           {"text", ""},
                           {"occlusion_deg", 0.0},
                           {"repetition", 0},
                           {"run", 0},
                           {"has_power", true},
                           {"drawing", ""}}));
  EXPECT_THAT(told_.questions, ElementsAre("Mount 45°, then type 45.", ""));
}

TEST_F(LiveProgressOf, PassesOnWhatIsKnownSoFar) {
  progress_.reached("so far K_T ± 0.05 %");
  EXPECT_THAT(told_.lines, ElementsAre("so far K_T ± 0.05 %")) << "the terminal keeps the line";
  const std::vector<json> told = messages();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0], json({{"type", "reached"}, {"text", "so far K_T ± 0.05 %"}}));
}

TEST_F(LiveProgressOf, ShowsTheNewestTickWithItsLimits) {
  seen_.judged[Watched::supply_current] = 7;
  seen_.judged[Watched::thrust] = 1.5;
  seen_.account.lost_host = 3;
  hold(4, std::chrono::milliseconds(20), -1.5, 9000);
  const Tick tick = feed_.newest();
  EXPECT_EQ(feed_.shown(), 2u);
  EXPECT_DOUBLE_EQ(tick.thrust_n(), -1.5);
  EXPECT_DOUBLE_EQ(tick.speed_rpm(), 9000);
  EXPECT_EQ(tick.position.step, 4);
  EXPECT_EQ(tick.seen.account.lost_host, 3u);
  EXPECT_DOUBLE_EQ(watched(Watched::thrust), 1.5) << "as the guard judged it";
  EXPECT_DOUBLE_EQ(watched(Watched::supply_current), 7);
  EXPECT_TRUE(std::isnan(watched(Watched::speed_error)));
}

TEST_F(LiveProgressOf, TellsTheTableOfTheGuardAndWhoSetEachLimit) {
  progress_.guarded({{Watched::thrust, "thrust", 20, "N", "campaign limits.thrust_max_n"},
                     {Watched::supply_voltage_low, "supply voltage", 5, "V", "device motor x", true}});
  EXPECT_EQ(told_.limits, 2u);
  const std::vector<json> told = messages();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0]["type"], "limits");
  EXPECT_EQ(told[0]["limits"][0]["source"], "campaign limits.thrust_max_n");
  EXPECT_EQ(told[0]["limits"][1]["key"], "voltage_low_v");
  EXPECT_EQ(told[0]["limits"][1]["lower"], true);
}

TEST_F(LiveProgressOf, ShowsNoNumberForWhatNoLongerComes) {
  seen_.load_cell_age = std::chrono::milliseconds(840);
  hold(0, std::chrono::milliseconds(10), 1, 6000);
  const json tick = json::parse(tick_message(feed_.newest(), 0, 0));
  EXPECT_TRUE(tick["thrust_n"].is_null());
  EXPECT_DOUBLE_EQ(tick["thrust_age_s"], 0.84);
  EXPECT_DOUBLE_EQ(tick["speed_rpm"], 6000);
}

TEST_F(LiveProgressOf, TellsKOfAStepWithoutItsBeginning) {
  hold(0, std::chrono::milliseconds(300), 99, 6000);  // does not count
  hold(0, std::chrono::milliseconds(500), 1, 6000);
  progress_.step_done(position_, seen_);
  const std::vector<json> told = messages();
  ASSERT_EQ(told.size(), 1u);
  const double omega = from_rpm(6000).value();
  EXPECT_NEAR(told[0]["k_n_s2"].get<double>() * omega * omega, 1, 1e-7);
  EXPECT_EQ(told[0]["occlusion_deg"], 90);
  EXPECT_EQ(told[0]["step"], 0);
}

TEST_F(LiveProgressOf, BeginsEveryStepAnew) {
  hold(0, std::chrono::milliseconds(800), 5, 6000);
  hold(1, std::chrono::milliseconds(800), 1, 6000);
  progress_.step_done(position_, seen_);
  EXPECT_NEAR(messages().at(0)["thrust_n"].get<double>(), 1, 1e-9);
}

TEST_F(LiveProgressOf, TellsTheShareOfTheCampaignAndTheSamplesOfItsRunsBefore) {
  position_.done = 0.75;
  position_.samples_before = 1'000'000;
  seen_.account.received = 234;
  hold(0, std::chrono::milliseconds(10), 1, 6000);
  const json tick = json::parse(tick_message(feed_.newest(), 0, 0));
  EXPECT_DOUBLE_EQ(tick["progress"], 0.75);
  EXPECT_EQ(tick["samples"], 1'000'234);
  EXPECT_EQ(tick["received"], 234);
}

TEST_F(LiveProgressOf, GivesThePlotterTheLimitsOfTheGuardAtWork) {
  boost::asio::io_context io;
  using boost::asio::ip::udp;
  udp::socket plotter(io, udp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
  UdpJson sender("127.0.0.1:" + std::to_string(plotter.local_endpoint().port()), {});
  LiveProgress progress(told_, feed_, &sender, subject_, clock_);
  progress.guarded({{Watched::thrust, "thrust", 20, "N", "campaign limits.thrust_max_n"}});
  seen_.judged[Watched::thrust] = 5;
  progress.tick(position_, seen_);
  std::array<char, 2048> bytes{};
  const std::size_t n = plotter.receive(boost::asio::buffer(bytes));
  EXPECT_EQ(json::parse(bytes.begin(), bytes.begin() + static_cast<long>(n)).at("limit_share").at("thrust_n"), 0.25);
}

TEST(LiveFeed, DropsAndCountsWhatNobodyTakes) {
  Feed feed(4);
  for (int i = 0; i < 10; ++i) feed.tell({Message::Kind::other, "{}"});
  EXPECT_EQ(feed.dropped(), 6u);
  int taken = 0;
  feed.take([&](const Message&) { ++taken; });
  EXPECT_EQ(taken, 4);
}

TEST(LiveFeed, AsksForAStopOnce) {
  Feed feed;
  EXPECT_FALSE(feed.stop_asked());
  EXPECT_TRUE(feed.ask_stop());
  EXPECT_FALSE(feed.ask_stop());
  EXPECT_TRUE(feed.stop_asked());
}

std::vector<std::string> types(const History& history) {
  std::vector<std::string> found;
  const json message = json::parse(history.message());
  for (const json& each : message["messages"]) found.push_back(each["type"]);
  return found;
}

Tick tick_at(double time_s) {
  Tick tick;
  tick.time_s = time_s;
  tick.seen.thrust_n = 2.5;
  tick.seen.motor_age = std::chrono::seconds(1);
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

TEST(History, KeepsABoundedNumberOfSteps) {
  History history;
  for (std::size_t i = 0; i <= History::kMostSteps; ++i) history.keep({Message::Kind::step, R"({"type":"step"})"});
  EXPECT_EQ(types(history).size(), History::kMostSteps);
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

}  // namespace live_session_test
}  // namespace kphi::daq::live
