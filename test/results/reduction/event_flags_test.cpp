#include <gtest/gtest.h>

#include "results/reduction/quality_flags.hpp"
#include "results/steps_csv.hpp"

namespace kphi::results {
namespace event_flags_test {

std::string flags(const std::vector<StreamEvent>& events, Nanoseconds begin, Nanoseconds end) {
  return quality_flag_names(flags_within(flag_spans(events), begin, end));
}

TEST(EventFlags, AnInstantConcernsTheStepInWhichItLies) {
  const std::vector<StreamEvent> events{{EventKind::restarted, 150, 0, ""}};
  EXPECT_EQ(flags(events, 0, 150), "");
  EXPECT_EQ(flags(events, 150, 300), "stream_restarted");
  EXPECT_EQ(flags(events, 300, 450), "");
}

TEST(EventFlags, ARestartOfTheMotorModuleConcernsItsStepAndALossAllUntilItIsBack) {
  const std::vector<StreamEvent> events{{EventKind::motor_reset, 150, 0, ""},
                                        {EventKind::motor_port_lost, 250, 0, ""},
                                        {EventKind::motor_connected, 450, 0, ""}};
  EXPECT_EQ(flags(events, 0, 150), "");
  EXPECT_EQ(flags(events, 100, 200), "motor_reset");
  EXPECT_EQ(flags(events, 200, 300), "motor_lost");
  EXPECT_EQ(flags(events, 300, 400), "motor_lost");
  EXPECT_EQ(flags(events, 451, 500), "");
}

TEST(EventFlags, ASlowLineBlursAllThatFollows) {
  const std::vector<StreamEvent> events{{EventKind::motor_slow_round_trip, 150, 0, ""}};
  EXPECT_EQ(flags(events, 0, 150), "");
  EXPECT_EQ(flags(events, 100, 200), "slow_round_trip");
  EXPECT_EQ(flags(events, 900, 1000), "slow_round_trip");
}

TEST(EventFlags, AStallConcernsAllStepsUntilItEnds) {
  const std::vector<StreamEvent> events{{EventKind::stalled, 150, 0, ""}, {EventKind::stall_ended, 350, 0, ""}};
  EXPECT_EQ(flags(events, 0, 100), "");
  EXPECT_EQ(flags(events, 100, 200), "stalled");
  EXPECT_EQ(flags(events, 200, 300), "stalled");
  EXPECT_EQ(flags(events, 300, 400), "stalled");
  EXPECT_EQ(flags(events, 400, 500), "");
}

TEST(EventFlags, ASilenceThatDoesNotEndConcernsAllThatFollows) {
  const std::vector<StreamEvent> events{{EventKind::silent, 150, 0, ""}, {EventKind::taken_over, 160, 0, ""}};
  EXPECT_EQ(flags(events, 1000, 2000), "silent+taken_over");
}

TEST(EventFlags, AnotherConfigurationConcernsTheWholeRunBecauseNobodyKnowsSinceWhen) {
  for (const EventKind kind : {EventKind::configuration_changed, EventKind::unusable}) {
    const std::vector<StreamEvent> events{{kind, 150, 0, ""}};
    EXPECT_EQ(flags(events, 0, 100), "configuration_changed");
    EXPECT_EQ(flags(events, 200, 300), "configuration_changed");
  }
}

TEST(EventFlags, RangesAndRestartsOfTheBoxShowInTheSamplesThemselves) {
  for (const EventKind kind : {EventKind::near_range, EventKind::beyond_range, EventKind::rebooted}) {
    EXPECT_TRUE(flag_spans(std::vector<StreamEvent>{{kind, 5, 0, ""}}).empty());
  }
}

}  // namespace event_flags_test
}  // namespace kphi::results
