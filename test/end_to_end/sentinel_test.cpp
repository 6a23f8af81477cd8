// kill -9 at random instants of a campaign over the true transports: within a second the supply is off and the box
// quiet, and the motor coasts within its module's time-out and 50 ms.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "test/end_to_end/running_bench.hpp"

namespace kphi::test::sentinel_test {

constexpr double kModuleCoasts_ms = 500 + 50;
constexpr double kSoon_s = 1, kWholeRun_s = 9;  // from the start of the program into its second run
constexpr double kMost_mb = 3;
constexpr auto kLimit = std::chrono::seconds(1);

bool is_safe(const nlohmann::json& now) { return now["supply"]["output"] == false && now["streaming"] == false; }

/// Of the sentinel that a thread of the program has started; 0: none yet.
int sentinel_of(int program) {
  std::error_code none;
  for (const auto& thread : std::filesystem::directory_iterator(fmt::format("/proc/{}/task", program), none)) {
    std::ifstream children(thread.path() / "children");
    if (int child = 0; children >> child) return child;
  }
  return 0;
}

double resident_mb(int process) {
  std::ifstream status(fmt::format("/proc/{}/status", process));
  for (std::string word; status >> word;)
    if (double kilobytes = 0; word == "VmRSS:" && status >> kilobytes) return kilobytes / 1024;
  return 0;
}

/// The kills of one bench, from a seed.
struct Kills {
  int number = 10;
  unsigned seed = 1;
};

std::ostream& operator<<(std::ostream& out, const Kills& kills) {
  return out << kills.number << " kills from seed " << kills.seed;
}

class KilledWithPower : public testing::TestWithParam<Kills> {};

TEST_P(KilledWithPower, LeavesTheSupplyOffTheBoxQuietAndTheMotorCoasting) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  const auto [number, seed] = GetParam();
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> instant_s(kSoon_s, kWholeRun_s);
  std::vector<double> kills_ms;
  double longest_s = 0, memory_mb = 0;
  int powered = 0;
  for (int kill = 0; kill < number; ++kill) {
    Process run(bench.run_command());
    const double at_s = 1e-3 * bench.time_ms() + instant_s(random);
    ASSERT_TRUE(bench.await([&](const auto& now) { return now["bench_time_s"] > at_s; }));
    if (const int sentinel = sentinel_of(run.pid())) memory_mb = std::max(memory_mb, resident_mb(sentinel));
    powered += bench.status()["supply"]["output"] == true;
    run.signal(SIGKILL);
    const auto killed = std::chrono::steady_clock::now();
    kills_ms.push_back(bench.time_ms());
    const bool safe = bench.await(is_safe, std::chrono::seconds(5));
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - killed;
    ASSERT_TRUE(bench.await([](const auto& now) { return now["drive"]["mode"] == "coast"; }));
    longest_s = std::max(longest_s, took.count());
    EXPECT_EQ(run.wait(), 128 + SIGKILL) << "kill " << kill << "\n" << run.err();
    ASSERT_TRUE(safe) << "kill " << kill << "\n" << bench.status().dump() << "\n" << run.err();
  }
  EXPECT_LT(longest_s, std::chrono::duration<double>(kLimit).count());
  // Nearly all that a sanitizer's takes is the sanitizer's.
  if (!kphi_is_of_another_build()) {
    EXPECT_LT(memory_mb, kMost_mb);
  }
  EXPECT_GT(powered, number / 4) << "enough of them with the supply on";
  const Account account = bench.account();
  for (const double at : kills_ms)
    EXPECT_TRUE(safely(account.stage_at(at + kModuleCoasts_ms) == "coast")) << at << " ms";
  EXPECT_TRUE(safely(account.ends_without_power()));
  fmt::print("{} kills, {} with power: all is off after {:.3f} s at most; the sentinel takes {:.1f} MB\n", number,
             powered, longest_s, memory_mb);
}

std::vector<Kills> of_ten_benches() {
  std::vector<Kills> kills;
  for (unsigned seed = 1; seed <= 10; ++seed) kills.push_back({100, seed});
  return kills;
}

INSTANTIATE_TEST_SUITE_P(Few, KilledWithPower, testing::Values(Kills{10, 1}));
INSTANTIATE_TEST_SUITE_P(Many, KilledWithPower, testing::ValuesIn(of_ten_benches()));

/// A run whose motor turns.
class Sentinel : public testing::Test {
 protected:
  Sentinel() {
    run_.wait_for("step  1/");
    sentinel_ = sentinel_of(run_.pid());
  }
  RunningBench bench_{Manner{.time_scale = 4, .supply = true}};
  Process run_{bench_.run_command()};
  int sentinel_ = 0;
};

TEST_F(Sentinel, IsGoneAfterARunThatEnds) {
  ASSERT_GT(sentinel_, 0);
  EXPECT_EQ(run_.wait(), 0) << run_.err();
  EXPECT_NE(::kill(sentinel_, 0), 0) << "still there";
  EXPECT_EQ(run_.err().find("kphi-sentinel"), std::string::npos) << "it has nothing to say";
}

TEST_F(Sentinel, DoesNotMindWhatEndsItsProgramFromATerminal) {
  ASSERT_GT(sentinel_, 0);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) EXPECT_EQ(::kill(sentinel_, number), 0);
  EXPECT_EQ(run_.wait(), 0) << run_.err();
}

TEST_F(Sentinel, ThatIsKilledIsReplacedAndTheRunSaysSo) {
  ASSERT_GT(sentinel_, 0);
  ASSERT_EQ(::kill(sentinel_, SIGKILL), 0);
  run_.wait_for("sentinel: it was killed by signal 9; another one watches now");
  ASSERT_GT(sentinel_of(run_.pid()), 0);
  run_.signal(SIGKILL);
  EXPECT_TRUE(safely(bench_.await(is_safe))) << "the other one has done it";
}

TEST_F(Sentinel, ThatCannotBeReplacedStopsTheMotor) {
  for (bool more = true; more; more = run_.hear(std::chrono::milliseconds(1)))
    if (const int sentinel = sentinel_of(run_.pid())) ::kill(sentinel, SIGKILL);
  EXPECT_EQ(run_.wait(), 4) << run_.err();
  EXPECT_NE(run_.err().find("install kphi again"), std::string::npos) << run_.err();
  EXPECT_TRUE(safely(bench_.account().ends_without_power()));
}

TEST_F(Sentinel, DoesNotSaySwitchedOffOfASupplyThatIgnoresItsOrder) {
  (void)bench_.fault("kind=supply_ignored_writes for_s=1000");
  run_.signal(SIGKILL);
  run_.wait_for("IS STILL ON, switch it off by hand");
  EXPECT_EQ(bench_.status()["supply"]["output"], true);
}

}  // namespace kphi::test::sentinel_test
