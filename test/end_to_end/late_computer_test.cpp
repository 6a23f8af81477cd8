// A computer that others keep busy. What its serial ports hear it hands on late, whatever the priority of kphi: kphi
// names the computer then, not the motor, and the motor coasts.
#include <sched.h>
#include <sys/time.h>
#include <sys/wait.h>

#include "results/journal.hpp"
#include "test/end_to_end/running_bench.hpp"

namespace kphi::test::late_computer_test {

/// A busy loop on each processor, below the priority of the programs under test and above everything else, this test
/// and the kernel's workers included. So it ends by itself.
class BusyLoops {
 public:
  static constexpr int kPriority = 5;  // of SCHED_FIFO; in_real_time() gives 10

  explicit BusyLoops(std::chrono::milliseconds lasts) {
    cpu_set_t all;
    sched_getaffinity(0, sizeof all, &all);
    for (int processor = 0; processor < CPU_SETSIZE; ++processor)
      if (CPU_ISSET(processor, &all)) loops_.push_back(loop_on(processor, lasts));
  }
  ~BusyLoops() {
    for (const pid_t loop : loops_) kill(loop, SIGKILL);
    for (const pid_t loop : loops_) waitpid(loop, nullptr, 0);
  }
  BusyLoops(const BusyLoops&) = delete;
  BusyLoops& operator=(const BusyLoops&) = delete;

 private:
  static pid_t loop_on(int processor, std::chrono::milliseconds lasts) {
    const pid_t child = fork();
    if (child != 0) return child;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(processor, &one);
    const sched_param priority{kPriority};
    const itimerval end{{}, {lasts.count() / 1000, lasts.count() % 1000 * 1000}};
    if (setitimer(ITIMER_REAL, &end, nullptr) != 0 || sched_setaffinity(0, sizeof one, &one) != 0 ||
        sched_setscheduler(0, SCHED_FIFO, &priority) != 0)
      _exit(1);
    for (;;) {
    }
  }
  std::vector<pid_t> loops_;
};

TEST(LateComputer, IsNamedWhereItKeepsBackWhatTheMotorSays) {
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 60));
  Process run(bench.run_command());
  ASSERT_TRUE(bench.await_speed(500)) << run.err();
  if (!run.is_real_time()) GTEST_SKIP() << "no real-time priority: nothing to hold against busy loops";
  const double busy_ms = bench.time_ms();
  const BusyLoops loops(std::chrono::milliseconds(800));
  EXPECT_EQ(run.wait(), 4) << run.err();
  const auto folder = campaign_below(bench.path("results"), "journal.jsonl");
  ASSERT_TRUE(folder);
  std::string reason;
  for (const auto& entry : results::read_journal(folder->journal()).entries)
    if (entry.event == "campaign_stopped") reason = entry.data.at("reason");
  EXPECT_TRUE(safely(reason.starts_with("this computer")))
      << reason;  // no excuse for a late computer: that is what is tested
  const Account account = bench.account();
  fmt::print("{}\ncoasts {:.0f} ms after the computer became busy\n", reason, account.coasts_at() - busy_ms);
  EXPECT_TRUE(safely(account.coasts_at() - busy_ms < 1500));
  EXPECT_TRUE(safely(account.ends_without_power()));
}

}  // namespace kphi::test::late_computer_test
