// A terminal that is blocked blocks nothing but itself: the run goes on and hears its signals, the motor coasts by the
// simulated motor's own account, and the program ends with its own exit code while the terminal stays blocked.
#include <gmock/gmock.h>

#include <tuple>

#include "test/blockable_output.hpp"
#include "test/end_to_end/running_bench.hpp"

namespace kphi::test::blocked_terminal_test {

using std::chrono::seconds;
using Kind = BlockableOutput::Kind;

constexpr double kPrompt = 200;       // ms
constexpr double kTurns = 500;        // rad/s
constexpr double kBlockedFor = 1.2;   // s: three times what the guard bears of a runner that hangs
constexpr auto kLimit = seconds(20);  // for a program that ends
constexpr int kInterrupted = 130;

class BlockedTerminal {
 public:
  BlockedTerminal(Kind kind, const Manner& manner) : bench(manner), output(kind) {}

  /// The program, what it says on stderr going to the output.
  [[nodiscard]] std::vector<std::string> command() const {
    return by_shell(R"(exec "$@" 2>")" + output.path() + '"', bench.run_command());
  }

  RunningBench bench;
  BlockableOutput output;
};

class BlockedInARun : public testing::TestWithParam<std::tuple<Kind, int>> {};

TEST_P(BlockedInARun, StillHearsTheSignalWhileTheMotorTurns) {
  const auto [kind, signal_number] = GetParam();
  BlockedTerminal blocked(kind, Manner{1, 7000, "  []\n", true});
  write(blocked.bench.path("short.yaml"), short_campaign_text("0", 1, 12));
  Process run(blocked.command());
  ASSERT_TRUE(blocked.bench.await_speed(kTurns)) << blocked.output.read();
  blocked.output.block();
  const double blocked_at_s = blocked.bench.status()["bench_time_s"];
  ASSERT_TRUE(blocked.bench.await([&](const auto& now) { return now["bench_time_s"] > blocked_at_s + kBlockedFor; }));
  const double cause_ms = blocked.bench.time_ms();
  const auto begun = std::chrono::steady_clock::now();
  run.signal(signal_number);
  EXPECT_EQ(run.wait(kLimit), kInterrupted);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  const Account account = blocked.bench.account();
  EXPECT_EQ(account.stage_at(cause_ms - 1), "drive") << "the blocked terminal alone stopped the run";
  const double coasts_ms = account.coasts_at() - cause_ms;
  fmt::print("coasts {:.1f} ms after the signal, ends after {:.2f} s\n", coasts_ms, took.count());
  (void)safely(coasts_ms <= kPrompt);
  EXPECT_LE(coasts_ms, kPrompt);
  EXPECT_LE(account.last_speed_at() - cause_ms, kPrompt);
  EXPECT_TRUE(account.ends_without_power());
}

INSTANTIATE_TEST_SUITE_P(Each, BlockedInARun,
                         testing::Combine(testing::ValuesIn(kBlockableKinds), testing::Values(SIGINT, SIGTERM)),
                         [](const auto& each) {
                           return testing::PrintToString(std::get<Kind>(each.param)) +
                                  (std::get<int>(each.param) == SIGINT ? "Interrupt" : "Terminate");
                         });

class BlockedForGood : public testing::TestWithParam<Kind> {};

TEST_P(BlockedForGood, LetsAWholeCampaignEndWell) {
  BlockedTerminal blocked(GetParam(), Manner{3});
  write(blocked.bench.path("short.yaml"), short_campaign_text("0, 90", 1, 2));
  blocked.output.block();
  Process run(blocked.command());
  const int exit_code = run.wait(seconds(60));
  const auto results = std::filesystem::directory_iterator(blocked.bench.path("results"));
  ASSERT_NE(results, std::filesystem::directory_iterator());
  const std::string folder = results->path().string();
  EXPECT_EQ(exit_code, 0) << bytes_of(folder + "/journal.jsonl");
  EXPECT_EQ(run.out(), folder + "\n") << "stdout is not blocked";
}

INSTANTIATE_TEST_SUITE_P(Each, BlockedForGood, testing::ValuesIn(kBlockableKinds), testing::PrintToStringParamName());

/// Ctrl-S, and some time later Ctrl-Q.
TEST(TerminalThatGoesOn, ShowsWhatWasSaidMeanwhile) {
  BlockedTerminal blocked(Kind::stopped_terminal, Manner{3});
  write(blocked.bench.path("short.yaml"), short_campaign_text("0", 1, 2));
  blocked.output.block();
  Process run(blocked.command());
  ASSERT_TRUE(blocked.bench.await_speed(kTurns));
  EXPECT_EQ(blocked.output.read(), "");
  blocked.output.resume();
  EXPECT_EQ(run.wait(seconds(60)), 0);
  const std::string said = blocked.output.read();
  EXPECT_THAT(said, testing::HasSubstr("Ctrl-C coasts the motor"));
  EXPECT_THAT(said, testing::HasSubstr("run  1/1"));
  EXPECT_THAT(said, testing::HasSubstr("\nnext: kphi fit ")) << "the last words";
}

}  // namespace kphi::test::blocked_terminal_test
