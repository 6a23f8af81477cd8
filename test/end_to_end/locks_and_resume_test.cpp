// Two programs on one bench, and a campaign that goes on, over the real transports.
#include <gmock/gmock.h>

#include "results/campaign_folder.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/source_dir.hpp"

namespace kphi::test::locks_and_resume_test {

using namespace testing;

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
    EXPECT_THAT(ran(command, 6).err, AllOf(HasSubstr(holder), HasSubstr(fmt::format("kill -INT {}", first.pid()))));
  }
  EXPECT_THAT(ran(resume_command(bench, folder_of(bench)), 6).err,
              AllOf(HasSubstr(holder), HasSubstr("wait for it, or stop it with")));
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

  EXPECT_THAT(ran(resume_command(bench, folder)).err, AllOf(HasSubstr("of 3 runs accepted"), HasSubstr("run  3/3")))
      << "a dead program's locks are no obstacle";
  (void)ran({kphi(), "verify", folder});
  const Ended again = ran(resume_command(bench, folder));
  EXPECT_THAT(again.err, HasSubstr("is finished: all 3 runs accepted"));
  EXPECT_EQ(again.out, folder + "\n");
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
  EXPECT_THAT(ran(joined(resume_command(bench, folder), {bench.path("other.yaml")}), 2).err,
              AllOf(HasSubstr("the campaign file has changed"), HasSubstr("--accept-changes")));
}

TEST(Resume, NeedsACampaignOrAFolder) {
  EXPECT_THAT(ran({kphi(), "run", "--bench", source_dir() + "/profiles/bench_deterministic.yaml"}, 2).err,
              HasSubstr("no campaign; give its file, or a folder with --resume"));
}

}  // namespace kphi::test::locks_and_resume_test
