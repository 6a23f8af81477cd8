// The computer of a campaign sleeps in the midst of it, whatever it does just then and for however long: no order to
// turn reaches the module after the waking, the run ends as a safety stop that names the sleep, what was recorded is
// kept, and the campaign goes on.
#include <gmock/gmock.h>

#include "test/end_to_end/sleeping_host.hpp"

namespace kphi::test::sleep_test {

using testing::ContainsRegex;

constexpr int kSafetyStop = 4;
constexpr const char* kStopWords = "SAFETY STOP";
constexpr const char* kSleepWords = "slept|was asleep";
constexpr int kTrials = 3;  // until the program was caught at the moment
constexpr double kRpm = 60 / (2 * 3.14159265358979);

struct Row {
  Sleep sleep;
  bool goes_on = true;  ///< afterwards the campaign is resumed
};

const char* name_of(Moment moment) {
  switch (moment) {
    case Moment::connecting:
      return "Connecting";
    case Moment::prompt:
      return "Prompt";
    case Moment::zero:
      return "Zero";
    case Moment::ramp_up:
      return "RampUp";
    case Moment::ramp_down:
      return "RampDown";
    case Moment::step:
      return "Step";
    case Moment::spin_down:
      return "SpinDown";
  }
  return "";
}

std::string name_of(const Row& row) {
  const Sleep& sleep = row.sleep;
  return fmt::format("{}_{:.0f}ms{}{}{}", name_of(sleep.moment), 1e3 * sleep.seconds, sleep.supply ? "_Supply" : "",
                     sleep.real_time ? "" : "_AnyPriority", sleep.sockets_kept ? "_SocketsKept" : "");
}

std::ostream& operator<<(std::ostream& out, const Row& row) { return out << name_of(row); }

constexpr Moment kMoments[]{Moment::connecting, Moment::prompt, Moment::zero,     Moment::ramp_up,
                            Moment::ramp_down,  Moment::step,   Moment::spin_down};

/// By night all, each resumed. By day five seconds with a supply, and one second of a step, which is resumed; at any
/// priority or with what the sockets kept, the ramp up.
std::vector<Row> rows(bool all) {
  std::vector<Row> rows;
  for (const Moment moment : kMoments) {
    for (const double seconds : {0.2, 1.0, 5.0, 60.0}) {
      for (const bool supply : {false, true}) {
        const bool resumed = all || seconds == 1;
        const bool by_day = supply && (seconds == 5 || (seconds == 1 && moment == Moment::step));
        if (all || by_day) rows.push_back({{moment, seconds, supply}, resumed});
        const bool varied_by_day = by_day && moment == Moment::ramp_up;
        const bool varied_by_night = all && (seconds == 1 || seconds == 5);
        if (!varied_by_day && !varied_by_night) continue;
        rows.push_back({{moment, seconds, supply, false, false}, resumed});
        rows.push_back({{moment, seconds, supply, true, true}, resumed});
      }
    }
  }
  return rows;
}

class SleepingComputer : public testing::TestWithParam<Row> {
 protected:
  void SetUp() override {
    for (int trial = 0; trial < kTrials && !awakening_; ++trial) {
      host_.emplace(GetParam().sleep);
      awakening_ = host_->sleep_once();
    }
    ASSERT_TRUE(awakening_) << "the program was never caught at the moment";
  }
  [[nodiscard]] bool says(const char* expression) const {
    return testing::Matches(ContainsRegex(expression))(awakening_->words);
  }
  void tell() const {
    fmt::print(
        "{:<34} exit {:3}  orders to turn {:3}  {:5.0f} RPM when it woke, at most {:5.0f} since, {} in the end\n",
        name_of(GetParam()), awakening_->exit_code, awakening_->told_to_turn(), awakening_->speed_rad_s * kRpm,
        awakening_->fastest_rad_s * kRpm, awakening_->stage_at_the_end());
    if (GetParam().sleep.real_time && !awakening_->was_real_time)
      fmt::print("  without a real-time priority, which was refused\n");
  }
  void look_at_what_is_kept() const {
    if (!host_->folder()) {
      EXPECT_EQ(GetParam().sleep.moment, Moment::connecting) << "nothing is kept";
      return;
    }
    EXPECT_EQ(host_->verify(), 0);
    EXPECT_TRUE(GetParam().sleep.moment < Moment::zero || !host_->recorded().empty());
  }
  void go_on() {
    std::string words;
    EXPECT_EQ(host_->go_on(words), 0) << words;
    EXPECT_EQ(host_->verify(), 0);
  }

  std::optional<SleepingHost> host_;
  std::optional<Awakening> awakening_;
};

TEST_P(SleepingComputer, TellsNoMotorToTurnWhenItWakes) {
  look_at_what_is_kept();
  if (GetParam().goes_on) go_on();
  host_->complete(*awakening_);
  tell();
  SCOPED_TRACE(awakening_->words);
  (void)safely(awakening_->told_to_turn() == 0 && awakening_->stage_at_the_end() == "coast" &&
               !awakening_->output_is_on);
  EXPECT_EQ(awakening_->told_to_turn(), 0);
  EXPECT_EQ(awakening_->stage_at_the_end(), "coast");
  EXPECT_FALSE(awakening_->output_is_on) << "of the supply";
  EXPECT_EQ(awakening_->exit_code, kSafetyStop);
  EXPECT_TRUE(says(kStopWords));
  EXPECT_TRUE(says(kSleepWords));
}

std::string name_in_suite(const testing::TestParamInfo<Row>& row) { return name_of(row.param); }

INSTANTIATE_TEST_SUITE_P(ByNight, SleepingComputer, testing::ValuesIn(rows(true)), name_in_suite);
INSTANTIATE_TEST_SUITE_P(ByDay, SleepingComputer, testing::ValuesIn(rows(false)), name_in_suite);

}  // namespace kphi::test::sleep_test
