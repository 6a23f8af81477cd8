// A terminal that is blocked blocks nothing but itself: the run goes on and hears its signals, the motor coasts by the
// simulated motor's own account, and the program ends with its own exit code while the terminal stays blocked.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>

#include <tuple>

#include "drivers/sim/control_line.hpp"
#include "test/blockable_output.hpp"
#include "test/end_to_end/account.hpp"
#include "test/end_to_end/running_bench.hpp"

namespace kphi::test {
namespace blocked_terminal_test {

using nlohmann::json;
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
    std::vector<std::string> words{"bash", "-c", R"(words=$1; shift; exec "$@" 2>"$words")", "bash", output.path()};
    for (const std::string& word : bench.run_command()) words.push_back(word);
    return words;
  }
  [[nodiscard]] json status() const { return json::parse(sim::tell(bench.path("control"), "status")); }
  template <class Holds>
  [[nodiscard]] bool await(Holds&& holds) const {
    const auto give_up = std::chrono::steady_clock::now() + kLimit;
    while (!holds(status())) {
      if (std::chrono::steady_clock::now() > give_up) return false;
      ::poll(nullptr, 0, 5);
    }
    return true;
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
  ASSERT_TRUE(blocked.await([](const json& now) { return now["speed_rad_s"] > kTurns; })) << blocked.output.read();
  blocked.output.block();
  const double blocked_at_s = blocked.status()["bench_time_s"];
  ASSERT_TRUE(blocked.await([&](const json& now) { return now["bench_time_s"] > blocked_at_s + kBlockedFor; }));
  const double cause_ms = 1e3 * blocked.status()["bench_time_s"].get<double>();
  const auto begun = std::chrono::steady_clock::now();
  run.signal(signal_number);
  EXPECT_EQ(run.wait(kLimit), kInterrupted);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  blocked.bench.process().signal(SIGTERM);
  ASSERT_EQ(blocked.bench.process().wait(), 0);
  const Account account = account_of(bytes_of(blocked.bench.path("wire.jsonl")));
  EXPECT_EQ(account.stage_at(cause_ms - 1), "drive") << "the blocked terminal alone stopped the run";
  ASSERT_EQ(account.stages.back().second, "coast");
  const double coasts_ms = account.stages.back().first - cause_ms;
  fmt::print("coasts {:.1f} ms after the signal, ends after {:.2f} s\n", coasts_ms, took.count());
  EXPECT_LE(coasts_ms, kPrompt);
  EXPECT_LE(account.last_speed_at() - cause_ms, kPrompt);
  ASSERT_FALSE(account.outputs.empty());
  EXPECT_FALSE(account.outputs.back()) << "the supply's output is on";
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
  ASSERT_TRUE(blocked.await([](const json& now) { return now["speed_rad_s"] > kTurns; }));
  EXPECT_EQ(blocked.output.read(), "");
  blocked.output.resume();
  EXPECT_EQ(run.wait(seconds(60)), 0);
  const std::string said = blocked.output.read();
  EXPECT_THAT(said, testing::HasSubstr("Ctrl-C coasts the motor"));
  EXPECT_THAT(said, testing::HasSubstr("run  1/1"));
  EXPECT_THAT(said, testing::HasSubstr("\nnext: kphi fit ")) << "the last words";
}

}  // namespace blocked_terminal_test
}  // namespace kphi::test
