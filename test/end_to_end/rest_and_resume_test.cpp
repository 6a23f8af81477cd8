// Nobody is asked to come near a rotor that turns or a motor that has power, and nothing starts again by itself after a
// safety stop: the program beside the simulated bench, over the real transports.
#include <gmock/gmock.h>

#include "test/end_to_end/running_bench.hpp"
#include "test/end_to_end/terminal.hpp"
#include "test/profiles/refusals.hpp"
#include "test/soon.hpp"

namespace kphi::test::rest_and_resume_test {

using namespace testing;

constexpr double kRpm = 60 / (2 * 3.14159265358979);
constexpr double kStandstill = 5;  // rad/s

class Stand {
 public:
  explicit Stand(bool supply, const std::string& faults = "  []\n") : bench({1, 7000, faults, supply}) {
    limit_thrust("20");
  }
  void limit_thrust(const std::string& newtons) const {
    using profiles::changed;
    const std::string text = changed(short_campaign_text("0, 90", 1, 3), "last_rpm: 18000", "last_rpm: 15000");
    write(bench.path("short.yaml"), changed(text, "thrust_max_n: 20", "thrust_max_n: " + newtons));
  }
  [[nodiscard]] double speed() const { return std::abs(bench.status()["speed_rad_s"].get<double>()); }
  [[nodiscard]] std::string folder() const {
    for (const auto& campaign : std::filesystem::directory_iterator(bench.path("results")))
      return campaign.path().string();
    throw std::runtime_error("no campaign was begun: " + words);
  }
  [[nodiscard]] std::vector<std::string> command(const std::vector<std::string>& more) const {
    return in_real_time(joined({kphi(), "run", "--bench", bench.path("bench.yaml")}, more));
  }
  [[nodiscard]] std::vector<std::string> first(const std::vector<std::string>& more) const {
    return joined(command({bench.path("short.yaml"), "--out", bench.path("results")}), more);
  }
  /// A campaign that a limit of its own stops in its first run.
  void stop_by_the_guard() {
    limit_thrust("1");
    words = ran(first({"--yes"}), 4).err;
  }

  RunningBench bench;
  std::string words;
};

class AfterAKill : public testing::TestWithParam<bool> {
 protected:
  /// At full speed.
  void kill_the_program() {
    Process run(stand_.first({"--yes"}));
    ASSERT_TRUE(soon([&] { return !run.hear() || stand_.speed() * kRpm > 14500; })) << run.err();
    ASSERT_GT(stand_.speed() * kRpm, 13000) << run.err();
    run.signal(SIGKILL);
    EXPECT_EQ(run.wait(), 128 + SIGKILL);
  }
  Stand stand_{GetParam()};
};

TEST_P(AfterAKill, TheNextProgramWaitsForStandstillBeforeAnythingIsMounted) {
  kill_the_program();
  // The simulated bench refuses a mounting while its rotor turns.
  (void)ran(stand_.command({"--yes", "--resume", stand_.folder()}));
}

TEST_P(AfterAKill, NobodyIsAskedToComeNearATurningRotor) {
  kill_the_program();
  const Terminal terminal;
  Process resumed(stand_.command({"--resume", stand_.folder()}), {}, {{}, terminal.descriptor()});
  resumed.wait_for("Mount no occlusion");
  EXPECT_LT(stand_.speed(), kStandstill);
  EXPECT_THAT(resumed.err(), HasSubstr(GetParam() ? "the supply's output is off" : "the motor HAS POWER"));
  resumed.signal(SIGINT);
  EXPECT_EQ(resumed.wait(), 130);
  const Account account = stand_.bench.account();
  EXPECT_EQ(account.ends_without_power(), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Of, AfterAKill, testing::Bool(), [](const testing::TestParamInfo<bool>& supply) {
  return std::string(supply.param ? "ABenchWithSupply" : "ABenchWithout");
});

TEST(Signal, WhileConnectingIsHeardBeforeAnythingIsSwitchedOn) {
  Stand stand(true, "  - {at_s: 0, for_s: 1000, kind: http_slow, delay_s: 1}\n");
  Process run(stand.first({"--yes"}));
  run.wait_for("Ctrl-C coasts the motor");
  run.signal(SIGINT);
  EXPECT_EQ(run.wait(), 130) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("STOPPED: stopped by request before anything was switched on"));
  const Account account = stand.bench.account();
  EXPECT_EQ(std::count(account.outputs.begin(), account.outputs.end(), true), 0);
}

TEST(SafetyStop, IsToldByCauseNextMoveDataAndWhatMotorAndSupplyDid) {
  for (const bool supply : {false, true}) {
    Stand stand(supply);
    stand.stop_by_the_guard();
    const std::string::size_type begin = stand.words.find("SAFETY STOP: thrust ");
    ASSERT_NE(begin, std::string::npos) << stand.words;
    const std::string told = stand.words.substr(begin);
    EXPECT_THAT(told, ContainsRegex("^SAFETY STOP: thrust .* N is above 1 N .campaign limits.thrust_max_n.\n"
                                    "  next:  check propeller, occlusion and load cell.*\n"
                                    "  data:  0 of 2 runs finished, in .*aborted.h5\n"
                                    " +continue with: kphi run .*--resume .*\n"
                                    "  motor: "));
    EXPECT_THAT(told, HasSubstr(supply ? "supply: output off\n" : "motor: coast confirmed after"));
    EXPECT_EQ(told.find("is above"), told.rfind("is above")) << "no sentence twice: " << told;
  }
}

TEST(SafetyStop, IsClearedOnlyByAPersonsOwnWord) {
  Stand stand(false);
  stand.stop_by_the_guard();
  std::string live = bytes_of(stand.bench.path("bench.yaml"));
  const std::string::size_type simulation = live.find("simulation:");
  live.erase(simulation, live.find('\n', simulation) + 1 - simulation);
  write(stand.bench.path("live.yaml"), live);
  const auto resume = [&](const std::vector<std::string>& more) {
    return joined({kphi(), "run", "--bench", stand.bench.path("live.yaml"), "--resume", stand.folder()}, more);
  };
  EXPECT_THAT(ran(resume({"--accept-changes", "--yes"}), 2).err,
              AllOf(HasSubstr("a safety stop ended this campaign: thrust "), HasSubstr("is above 1 N")))
      << "never --yes alone on a live bench";

  write(stand.bench.path("answers.yaml"), "format: kphi-answers/1\nmountings: [0, 90]\n");
  EXPECT_THAT(ran(resume({"--accept-changes", "--answers", stand.bench.path("answers.yaml")}), 2).err,
              HasSubstr("add continue_after_safety_stop: true"));

  const Terminal terminal;
  Process asked(resume({"--accept-changes"}), {}, {{}, terminal.descriptor()});
  asked.wait_for("A safety stop ended this campaign: thrust ");
  asked.wait_for_prompt();
  terminal.type("q");
  EXPECT_EQ(asked.wait(), 130) << asked.err();
  EXPECT_EQ(stand.bench.account().last_speed_at() > 0, true) << "of the first run";
}

TEST(SafetyStop, IsClearedByTheAnswersFileOnceAndNotBeforeItHappened) {
  Stand stand(false);
  write(stand.bench.path("answers.yaml"),
        "format: kphi-answers/1\nmountings: [0, 90]\ncontinue_after_safety_stop: true\n");
  const std::vector<std::string> answers{"--answers", stand.bench.path("answers.yaml")};
  EXPECT_THAT(ran(stand.first(answers), 2).err, HasSubstr("continue_after_safety_stop is not needed"));

  stand.stop_by_the_guard();
  stand.limit_thrust("20");
  (void)ran(
      stand.command(joined({stand.bench.path("short.yaml"), "--resume", stand.folder(), "--accept-changes"}, answers)));
  EXPECT_THAT(bytes_of(std::filesystem::path(stand.folder()) / "journal.jsonl"), HasSubstr("cleared_safety_stop"));
}

}  // namespace kphi::test::rest_and_resume_test
