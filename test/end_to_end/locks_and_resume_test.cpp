// Two programs on one bench, and a campaign that goes on, over the real transports.
#include <gmock/gmock.h>
#include <signal.h>

#include "results/campaign_folder.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/source_dir.hpp"

namespace kphi::test {
namespace locks_and_resume_test {

using testing::AllOf;
using testing::HasSubstr;

std::string folder_of(const RunningBench& bench) {
  return std::filesystem::directory_iterator(bench.path("results"))->path().string();
}

std::vector<std::string> resume_command(const RunningBench& bench, const std::string& folder) {
  return in_real_time({kphi(), "run", "--bench", bench.path("bench.yaml"), "--yes", "--resume", folder});
}

TEST(Locks, RefuseASecondProgramAndNameTheFirstWhichIsNotDisturbed) {
  RunningBench bench;
  Process first(bench.run_command());
  first.wait_for("step  2/4");
  const std::string holder = fmt::format("in use by process {} (", first.pid());
  for (const auto& command :
       {bench.run_command(), std::vector<std::string>{kphi(), "devices", "--bench", bench.path("bench.yaml")}}) {
    Process second(command);
    EXPECT_EQ(second.wait(), 3) << second.err();
    EXPECT_THAT(second.err(), AllOf(HasSubstr(holder), HasSubstr(fmt::format("kill -INT {}", first.pid()))));
  }
  Process third(resume_command(bench, folder_of(bench)));
  EXPECT_EQ(third.wait(), 2) << third.err();
  EXPECT_THAT(third.err(), AllOf(HasSubstr(holder), HasSubstr("wait for it, or stop it with")));
  EXPECT_EQ(first.wait(), 0) << first.err();
}

TEST(Resume, GoesOnAfterAKillAndSaysSoWhenAllIsDone) {
  RunningBench bench;
  Process run(bench.run_command());
  run.wait_for("run  1/3");
  run.wait_for("step  2/4");
  run.signal(SIGKILL);
  EXPECT_EQ(run.wait(), 128 + SIGKILL);
  const std::string folder = folder_of(bench);

  Process resumed(resume_command(bench, folder));
  EXPECT_EQ(resumed.wait(), 0) << "a dead program's locks are no obstacle: " << resumed.err();
  EXPECT_THAT(resumed.err(), AllOf(HasSubstr("of 3 runs accepted"), HasSubstr("run  3/3")));
  Process verify({kphi(), "verify", folder});
  EXPECT_EQ(verify.wait(), 0) << verify.out();

  Process again(resume_command(bench, folder));
  EXPECT_EQ(again.wait(), 0);
  EXPECT_THAT(again.err(), HasSubstr("is finished: all 3 runs accepted"));
  EXPECT_EQ(again.out(), folder + "\n");
}

TEST(Resume, RefusesAChangedCampaignBeforeAnyDeviceIsAsked) {
  RunningBench bench;
  Process run(bench.run_command());
  run.wait_for("run  1/3");
  run.signal(SIGINT);
  EXPECT_EQ(run.wait(), 130) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("continue with: kphi run "));
  const std::string folder = folder_of(bench);
  bench.process().signal(SIGKILL);

  write(bench.path("other.yaml"), short_campaign_text("0, 90"));
  auto command = resume_command(bench, folder);
  command.push_back(bench.path("other.yaml"));
  Process refused(command);
  EXPECT_EQ(refused.wait(), 2) << refused.err();
  EXPECT_THAT(refused.err(), AllOf(HasSubstr("the campaign file has changed"), HasSubstr("--accept-changes")));
}

TEST(Resume, NeedsACampaignOrAFolder) {
  Process nothing({kphi(), "run", "--bench", kphi::test::source_dir() + "/profiles/bench_deterministic.yaml"});
  EXPECT_EQ(nothing.wait(), 2);
  EXPECT_THAT(nothing.err(), HasSubstr("no campaign; give its file, or a folder with --resume"));
}

}  // namespace locks_and_resume_test
}  // namespace kphi::test
