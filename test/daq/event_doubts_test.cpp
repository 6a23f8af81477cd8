#include "daq/event_doubts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "results/steps_csv.hpp"

namespace kphi::daq {
namespace {

using results::EventKind;
using results::StreamEvent;

std::string doubts(const std::vector<StreamEvent>& events, results::Nanoseconds begin, results::Nanoseconds end) {
  return results::doubt_names(doubts_within(doubt_spans(events), begin, end));
}

TEST(EventDoubts, AnInstantConcernsTheStepInWhichItLies) {
  const std::vector<StreamEvent> events{{EventKind::restarted, 150, 0, ""}};
  EXPECT_EQ(doubts(events, 0, 150), "");
  EXPECT_EQ(doubts(events, 150, 300), "stream_restarted");
  EXPECT_EQ(doubts(events, 300, 450), "");
}

TEST(EventDoubts, ARestartOfTheMotorModuleConcernsItsStepAndALossAllUntilItIsBack) {
  const std::vector<StreamEvent> events{{EventKind::motor_reset, 150, 0, ""},
                                        {EventKind::motor_port_lost, 250, 0, ""},
                                        {EventKind::motor_connected, 450, 0, ""}};
  EXPECT_EQ(doubts(events, 0, 150), "");
  EXPECT_EQ(doubts(events, 100, 200), "motor_reset");
  EXPECT_EQ(doubts(events, 200, 300), "motor_lost");
  EXPECT_EQ(doubts(events, 300, 400), "motor_lost");
  EXPECT_EQ(doubts(events, 451, 500), "");
}

TEST(EventDoubts, ASlowLineBlursAllThatFollows) {
  const std::vector<StreamEvent> events{{EventKind::motor_slow_round_trip, 150, 0, ""}};
  EXPECT_EQ(doubts(events, 0, 150), "");
  EXPECT_EQ(doubts(events, 100, 200), "slow_round_trip");
  EXPECT_EQ(doubts(events, 900, 1000), "slow_round_trip");
}

TEST(EventDoubts, AStallConcernsAllStepsUntilItEnds) {
  const std::vector<StreamEvent> events{{EventKind::stalled, 150, 0, ""}, {EventKind::stall_ended, 350, 0, ""}};
  EXPECT_EQ(doubts(events, 0, 100), "");
  EXPECT_EQ(doubts(events, 100, 200), "stalled");
  EXPECT_EQ(doubts(events, 200, 300), "stalled");
  EXPECT_EQ(doubts(events, 300, 400), "stalled");
  EXPECT_EQ(doubts(events, 400, 500), "");
  EXPECT_THAT(stall_ends(events), testing::ElementsAre(350));
}

TEST(EventDoubts, ASilenceThatDoesNotEndConcernsAllThatFollows) {
  const std::vector<StreamEvent> events{{EventKind::silent, 150, 0, ""}, {EventKind::stolen, 160, 0, ""}};
  EXPECT_EQ(doubts(events, 1000, 2000), "silent+stolen");
}

TEST(EventDoubts, AnotherConfigurationConcernsTheWholeRunBecauseNobodyKnowsSinceWhen) {
  for (const EventKind kind : {EventKind::configuration_changed, EventKind::unusable}) {
    const std::vector<StreamEvent> events{{kind, 150, 0, ""}};
    EXPECT_EQ(doubts(events, 0, 100), "configuration_changed");
    EXPECT_EQ(doubts(events, 200, 300), "configuration_changed");
  }
}

TEST(EventDoubts, RangesAndRestartsOfTheBoxShowInTheSamplesThemselves) {
  for (const EventKind kind : {EventKind::near_range, EventKind::beyond_range, EventKind::rebooted}) {
    EXPECT_TRUE(doubt_spans(std::vector<StreamEvent>{{kind, 5, 0, ""}}).empty());
  }
}

}  // namespace
}  // namespace kphi::daq
