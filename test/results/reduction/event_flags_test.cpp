#include <gtest/gtest.h>

#include "results/reduction/quality_flags.hpp"
#include "results/steps_csv.hpp"

namespace kphi::results::event_flags_test {

struct Step {
  Nanoseconds begin, end;
  const char* flags;
};

void expect(const std::vector<StreamEvent>& events, const std::vector<Step>& steps) {
  for (const auto& [begin, end, flags] : steps)
    EXPECT_EQ(quality_flag_names(flags_within(flag_spans(events), begin, end)), flags) << "from " << begin;
}

TEST(EventFlags, AnInstantConcernsTheStepInWhichItLies) {
  expect({{EventKind::restarted, 150, 0, ""}}, {{0, 150, ""}, {150, 300, "stream_restarted"}, {300, 450, ""}});
}

TEST(EventFlags, ARestartOfTheMotorModuleConcernsItsStepAndALossAllUntilItIsBack) {
  expect({{EventKind::motor_reset, 150, 0, ""},
          {EventKind::motor_port_lost, 250, 0, ""},
          {EventKind::motor_connected, 450, 0, ""}},
         {{0, 150, ""}, {100, 200, "motor_reset"}, {200, 300, "motor_lost"}, {300, 400, "motor_lost"}, {451, 500, ""}});
}

TEST(EventFlags, ASlowLineBlursAllThatFollows) {
  expect({{EventKind::motor_slow_round_trip, 150, 0, ""}},
         {{0, 150, ""}, {100, 200, "slow_round_trip"}, {900, 1000, "slow_round_trip"}});
}

TEST(EventFlags, AStallConcernsAllStepsUntilItEnds) {
  expect({{EventKind::stalled, 150, 0, ""}, {EventKind::stall_ended, 350, 0, ""}},
         {{0, 100, ""}, {100, 200, "stalled"}, {200, 300, "stalled"}, {300, 400, "stalled"}, {400, 500, ""}});
}

TEST(EventFlags, ASilenceThatDoesNotEndConcernsAllThatFollows) {
  expect({{EventKind::silent, 150, 0, ""}, {EventKind::taken_over, 160, 0, ""}}, {{1000, 2000, "silent+taken_over"}});
}

TEST(EventFlags, AnotherConfigurationConcernsTheWholeRunBecauseNobodyKnowsSinceWhen) {
  for (const EventKind kind : {EventKind::configuration_changed, EventKind::unusable})
    expect({{kind, 150, 0, ""}}, {{0, 100, "configuration_changed"}, {200, 300, "configuration_changed"}});
}

TEST(EventFlags, RangesAndRestartsOfTheBoxShowInTheSamplesThemselves) {
  for (const EventKind kind : {EventKind::near_range, EventKind::beyond_range, EventKind::rebooted}) {
    EXPECT_TRUE(flag_spans(std::vector<StreamEvent>{{kind, 5, 0, ""}}).empty());
  }
}

}  // namespace kphi::results::event_flags_test
