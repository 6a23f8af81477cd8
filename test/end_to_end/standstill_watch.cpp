// Beside each test of real time: for how long this computer did not run a thread that only waits. A test that failed
// while it stood still for longer than a bench tolerates says nothing, and `./run test` repeats it, alone; every other
// failure stands.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <thread>

namespace kphi::test {
namespace {

constexpr int kProgramsPriority = 10;     // of SCHED_FIFO: in_real_time() gives it to the programs under test
constexpr double kRealTimeLimit_ms = 25;  // half of the 50 ms in which the guard's order to coast goes out
constexpr double kUsualLimit_ms = 145;    // silence of a stream that the guard tolerates
constexpr timespec kNap{0, 5'000'000};

/// A thread that naps, and how late it woke at worst.
class Sleeper {
 public:
  explicit Sleeper(int fifo_priority) : thread_([this, fifo_priority] { nap_until_end(fifo_priority); }) {}
  ~Sleeper() {
    ends_ = true;
    thread_.join();
  }
  Sleeper(const Sleeper&) = delete;
  Sleeper& operator=(const Sleeper&) = delete;

  /// Since the last call; 0: the priority was refused.
  double take_worst_ms() { return worst_ms_.exchange(0); }

 private:
  using Clock = std::chrono::steady_clock;
  void nap_until_end(int fifo_priority) {
    const sched_param priority{fifo_priority};
    if (fifo_priority > 0 && sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority) != 0) return;
    while (!ends_) {
      const auto due = Clock::now() + std::chrono::nanoseconds(kNap.tv_nsec);
      (void)clock_nanosleep(CLOCK_MONOTONIC, 0, &kNap, nullptr);
      const double late_ms = std::chrono::duration<double, std::milli>(Clock::now() - due).count();
      if (late_ms > worst_ms_) worst_ms_ = late_ms;
    }
  }
  std::atomic<double> worst_ms_{0};
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

class StandstillWatch final : public testing::EmptyTestEventListener {
  void OnTestStart(const testing::TestInfo&) override {
    real_time_ = std::make_unique<Sleeper>(kProgramsPriority);
    usual_ = std::make_unique<Sleeper>(0);
  }
  void OnTestEnd(const testing::TestInfo& info) override {
    const double real_time_ms = real_time_->take_worst_ms(), usual_ms = usual_->take_worst_ms();
    real_time_.reset();
    usual_.reset();
    if (!info.result()->Failed()) return;
    const std::string words = fmt::format(
        "this computer let a waiting thread wait for {:.0f} ms more at real-time priority (tolerated: {:.0f} ms), "
        "{:.0f} "
        "ms at the usual one (tolerated: {:.0f} ms)",
        real_time_ms, kRealTimeLimit_ms, usual_ms, kUsualLimit_ms);
    fmt::print("{}\n", words);
    if (real_time_ms > kRealTimeLimit_ms || usual_ms > kUsualLimit_ms)
      testing::Test::RecordProperty("standstill", words);
  }
  std::unique_ptr<Sleeper> real_time_, usual_;
};

/// Only where the test says that it is one of real time: see kphi_test(TIMED).
[[maybe_unused]] const bool kWatches = [] {
  if (std::getenv("KPHI_TIMED") != nullptr) testing::UnitTest::GetInstance()->listeners().Append(new StandstillWatch);
  return true;
}();

}  // namespace
}  // namespace kphi::test
