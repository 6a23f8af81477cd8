// Exit codes survive a standard stream that is closed, a reader that has gone, a disk that is full and a limit on the
// size of files: never a signal, and what is not said harms no file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>

#include "drivers/sim/control_line.hpp"
#include "test/end_to_end/account.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/soon.hpp"

namespace kphi::test {
namespace closed_streams_test {

using nlohmann::json;
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

std::vector<std::string> with(const Streams& streams, const std::vector<std::string>& command) {
  std::vector<std::string> words{"bash", "-c", streams.shell, "bash"};
  words.insert(words.end(), command.begin(), command.end());
  return words;
}

/// A bench with a supply at the pace of a clock, and a program whose motor turns.
class TurningRun {
 public:
  explicit TurningRun(const std::string& shell)
      : bench(Manner{1, 7000, "  []\n", true}),
        run((write(bench.path("short.yaml"), short_campaign_text("0", 1, 8)),
             with({"", shell.c_str()}, bench.run_command()))) {}
  [[nodiscard]] json status() const { return json::parse(sim::tell(bench.path("control"), "status")); }
  [[nodiscard]] bool turns() const {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!(status()["speed_rad_s"] > kTurns)) {
      if (std::chrono::steady_clock::now() > give_up) return false;
      ::poll(nullptr, 0, 5);
    }
    return true;
  }
  /// Ends the bench, and holds that the motor coasts soon after the cause.
  void expect_coast(double cause_ms, double limit_ms = kPrompt) {
    bench.process().signal(SIGTERM);
    ASSERT_EQ(bench.process().wait(), 0);
    const Account account = account_of(bytes_of(bench.path("wire.jsonl")));
    EXPECT_EQ(account.stage_at(cause_ms - 1), "drive");
    ASSERT_EQ(account.stages.back().second, "coast");
    EXPECT_LE(account.stages.back().first - cause_ms, limit_ms);
    ASSERT_FALSE(account.outputs.empty());
    EXPECT_FALSE(account.outputs.back()) << "the supply's output is on";
  }

  RunningBench bench;
  Process run;
};

class LeftStreams : public testing::TestWithParam<Streams> {};

TEST_P(LeftStreams, DoNotChangeTheExitCodeOfASafetyStop) {
  TurningRun scene(GetParam().shell);
  ASSERT_TRUE(scene.turns());
  const std::string answer = sim::tell(scene.bench.path("control"), "fault kind=supply_trip code=2");
  ASSERT_THAT(answer, testing::StartsWith("ok "));
  EXPECT_EQ(scene.run.wait(), 4);
  scene.expect_coast(1e3 * std::stod(answer.substr(3)));
}

TEST_P(LeftStreams, DoNotHarmARun) {
  RunningBench bench(Manner{3});
  write(bench.path("short.yaml"), short_campaign_text("0, 90", 1, 2));
  Process run(with(GetParam(), bench.run_command()));
  const int exit_code = run.wait();
  ASSERT_TRUE(std::filesystem::exists(bench.path("results"))) << "exit code " << exit_code;
  int campaigns = 0;
  for (const auto& folder : std::filesystem::directory_iterator(bench.path("results"))) {
    EXPECT_EQ(exit_code, 0) << bytes_of(folder.path() / "journal.jsonl");
    Process verify({kphi(), "verify", folder.path().string()});
    EXPECT_EQ(verify.wait(), 0) << verify.out();
    ++campaigns;
  }
  EXPECT_EQ(campaigns, 1);
}

TEST(ReadersThatLeave, DoNotChangeTheExitCodeOfASafetyStopThatFollows) {
  TurningRun scene(R"(exec "$@")");
  ASSERT_TRUE(scene.turns());
  scene.run.close_pipes();
  const std::string answer = sim::tell(scene.bench.path("control"), "fault kind=supply_trip code=2");
  ASSERT_THAT(answer, testing::StartsWith("ok "));
  EXPECT_EQ(scene.run.wait(), 4);
  scene.expect_coast(1e3 * std::stod(answer.substr(3)));
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
  const double cause_ms = 1e3 * scene.status()["bench_time_s"].get<double>();
  const rlimit nothing{1, 1};
  ASSERT_EQ(::prlimit(scene.run.pid(), RLIMIT_FSIZE, &nothing, nullptr), 0);
  EXPECT_EQ(scene.run.wait(), 1) << bytes_of(words);
  scene.expect_coast(cause_ms, kSecured + kPrompt);
}

/// A campaign in virtual time, and what reads it.
class LeftOutput : public testing::Test {
 protected:
  LeftOutput() {
    write(path("campaign.yaml"), short_campaign_text("0, 45, 180", 1, 4));
    write(path("bench.yaml"), deterministic_config(1).text);
    Process run({kphi(), "run", path("campaign.yaml"), "--bench", path("bench.yaml"), "--out", path("out"), "--yes"});
    EXPECT_EQ(run.wait(), 0) << run.err();
    campaign_ = run.out().substr(0, run.out().find('\n'));
  }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  /// The exit code of `kphi` with these words; what it said is in said_.
  int exit_code(const char* shell, std::vector<std::string> words) {
    words.insert(words.begin(), kphi());
    Process process(with({"", shell}, words));
    const int code = process.wait();
    said_ = process.err();
    return code;
  }

  TemporaryFolder folder_;
  std::string campaign_, said_;
};

TEST_F(LeftOutput, IsAFailureOfWhoeverHasDataToPrint) {
  for (const char* shell : {GONE R"(exec "$@" >&3 3>&-)", R"(exec "$@" >/dev/full)", R"(exec "$@" >&-)"}) {
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"fit", campaign_, "--no-report"},
          {"fit", campaign_, "--no-report", "--json"},
          {"replay", campaign_},
          {"info", campaign_},
          {"--help"},
          {"run", path("campaign.yaml"), "--bench", path("bench.yaml"), "--dry-run"}}) {
      EXPECT_EQ(exit_code(shell, words), 1) << shell << " " << words.front();
      EXPECT_THAT(said_, HasSubstr("kphi: ")) << shell << " " << words.front();
    }
  }
  EXPECT_TRUE(std::filesystem::exists(campaign_ + "/coefficients.yaml")) << "written before it is told";
}

TEST_F(LeftOutput, DoesNotHideAnErrorThatIsWorse) {
  EXPECT_EQ(exit_code(GONE R"(exec "$@" >&3 2>&3 3>&-)", {"fit", path("nothing")}), 2);
}

}  // namespace closed_streams_test
}  // namespace kphi::test
