// Exit codes survive a standard stream that is closed, a reader that has gone, a disk that is full and a limit on the
// size of files: never a signal, and what is not said harms no file.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include "test/end_to_end/running_bench.hpp"
#include "test/soon.hpp"

namespace kphi::test::closed_streams_test {

using testing::HasSubstr;

constexpr double kPrompt = 200;   // ms
constexpr double kTurns = 500;    // rad/s
constexpr double kSecured = 500;  // ms between two times that what was recorded is written

/// A shell line that starts the program, `"$@"`, with streams as somebody may leave them.
struct Streams {
  const char* name;
  const char* shell;
};
std::ostream& operator<<(std::ostream& out, const Streams& streams) { return out << streams.name; }

// The reader of 3 has gone before the program begins.
#define GONE "exec 3> >(:); wait $!; "
const Streams kLeft[] = {
    {"StderrClosed", R"(exec "$@" 2>&-)"},
    {"StderrReaderGone", GONE R"(exec "$@" 2>&3 3>&-)"},
    {"BothReadersGone", GONE R"(exec "$@" >&3 2>&3 3>&-)"},
    {"AllClosed", R"(exec "$@" <&- >&- 2>&-)"},
    {"DiskFull", R"(exec "$@" 2>/dev/full)"},
};

/// A bench with a supply at the pace of a clock, and a program whose motor turns.
class TurningRun {
 public:
  explicit TurningRun(const std::string& shell)
      : bench(Manner{1, 7000, "  []\n", true}),
        run((write(bench.path("short.yaml"), short_campaign_text("0", 1, 8)), by_shell(shell, bench.run_command()))) {}
  /// Ends the bench, and holds that the motor coasts soon after the cause.
  void expect_coast(double cause_ms, double limit_ms = kPrompt) {
    const Account account = bench.account();
    EXPECT_EQ(account.stage_at(cause_ms - 1), "drive");
    EXPECT_LE(account.coasts_at() - cause_ms, limit_ms);
    EXPECT_TRUE(account.ends_without_power());
  }
  void expect_safety_stop_of_the_supply() {
    const double cause_ms = bench.fault("kind=supply_trip code=2");
    EXPECT_EQ(run.wait(), 4);
    expect_coast(cause_ms);
  }

  RunningBench bench;
  Process run;
};

class LeftStreams : public testing::TestWithParam<Streams> {};

TEST_P(LeftStreams, DoNotChangeTheExitCodeOfASafetyStop) {
  TurningRun scene(GetParam().shell);
  ASSERT_TRUE(scene.bench.await_speed(kTurns));
  scene.expect_safety_stop_of_the_supply();
}

TEST_P(LeftStreams, DoNotHarmARun) {
  RunningBench bench(Manner{3});
  write(bench.path("short.yaml"), short_campaign_text("0, 90", 1, 2));
  Process run(by_shell(GetParam().shell, bench.run_command()));
  const int exit_code = run.wait();
  ASSERT_TRUE(std::filesystem::exists(bench.path("results"))) << "exit code " << exit_code;
  int campaigns = 0;
  for (const auto& folder : std::filesystem::directory_iterator(bench.path("results"))) {
    EXPECT_EQ(exit_code, 0) << bytes_of(folder.path() / "journal.jsonl");
    (void)ran({kphi(), "verify", folder.path().string()});
    ++campaigns;
  }
  EXPECT_EQ(campaigns, 1);
}

TEST(ReadersThatLeave, DoNotChangeTheExitCodeOfASafetyStopThatFollows) {
  TurningRun scene(R"(exec "$@")");
  ASSERT_TRUE(scene.bench.await_speed(kTurns));
  scene.run.close_pipes();
  scene.expect_safety_stop_of_the_supply();
}

INSTANTIATE_TEST_SUITE_P(Each, LeftStreams, testing::ValuesIn(kLeft),
                         [](const auto& each) { return std::string(each.param.name); });

/// The signal that comes with the limit does what it does by default. What the program says goes into a file, too,
/// which cannot grow either.
TEST(FileSizeLimit, InARunIsAFailureAfterWhichTheMotorCoasts) {
  TemporaryFolder folder;
  const std::string words = (folder.path() / "words.txt").string();
  TurningRun scene(R"(ulimit -c 0; exec "$@" 2>)" + words);
  const auto has_said = [&] { return bytes_of(words).find("step  1/") != std::string::npos; };
  ASSERT_TRUE(soon(has_said, std::chrono::seconds(20)));
  const double cause_ms = scene.bench.time_ms();
  const rlimit nothing{1, 1};
  ASSERT_EQ(::prlimit(scene.run.pid(), RLIMIT_FSIZE, &nothing, nullptr), 0);
  EXPECT_EQ(scene.run.wait(), 1) << bytes_of(words);
  scene.expect_coast(cause_ms, kSecured + kPrompt);
}

/// A campaign in virtual time, and what reads it.
class LeftOutput : public testing::Test, protected VirtualCampaign {
 protected:
  LeftOutput() : VirtualCampaign(short_campaign_text("0, 45, 180", 1, 4)) {}
  const std::string campaign_ = ran(command()).folder();
};

TEST_F(LeftOutput, IsAFailureOfWhoeverHasDataToPrint) {
  for (const char* shell : {GONE R"(exec "$@" >&3 3>&-)", R"(exec "$@" >/dev/full)", R"(exec "$@" >&-)"}) {
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"fit", campaign_, "--accept", "--no-report"},
          {"fit", campaign_, "--accept", "--no-report", "--json"},
          {"replay", campaign_},
          {"info", campaign_},
          {"--help"},
          {"run", path("campaign.yaml"), "--bench", path("bench.yaml"), "--dry-run"}}) {
      EXPECT_THAT(ran(by_shell(shell, joined({kphi()}, words)), 1).err, HasSubstr("kphi: ")) << shell << words.front();
    }
  }
  EXPECT_TRUE(std::filesystem::exists(campaign_ + "/coefficients.yaml")) << "written before it is told";
}

TEST_F(LeftOutput, DoesNotHideAnErrorThatIsWorse) {
  (void)ran(by_shell(GONE R"(exec "$@" >&3 2>&3 3>&-)", {kphi(), "fit", path("nothing")}), 2);
}

}  // namespace kphi::test::closed_streams_test
