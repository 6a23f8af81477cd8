// Beside each test of real time: for how long this computer did not run a thread that only waits, nor hand on what a
// pseudo-terminal heard. A test that failed while it stood still for longer than a bench tolerates says nothing, and
// `./run test` repeats it, alone; every other failure stands.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
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
constexpr double kHandedOnLimit_ms = 70;  // a question and its answer within that silence
constexpr timespec kNap{0, 10'000'000};

/// A pseudo-terminal that tells nobody but us what is written to it.
class Line {
 public:
  Line() {
    if (in_ < 0 || ::grantpt(in_) != 0 || ::unlockpt(in_) != 0) return;
    char name[64];
    if (::ptsname_r(in_, name, sizeof name) != 0) return;
    out_ = ::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios raw{};
    if (out_ < 0 || ::tcgetattr(out_, &raw) != 0) return;
    ::cfmakeraw(&raw);
    works_ = ::tcsetattr(out_, TCSANOW, &raw) == 0;
  }
  ~Line() {
    ::close(out_);
    ::close(in_);
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  /// Until the kernel has handed a byte from one end to the other, a second at most.
  void pass_a_byte() const {
    char byte = 0;
    if (!works_ || ::write(in_, &byte, 1) != 1) return;
    pollfd heard{out_, POLLIN, 0};
    if (::poll(&heard, 1, 1000) == 1) (void)::read(out_, &byte, 1);
  }

 private:
  int in_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC), out_ = -1;
  bool works_ = false;
};

using Clock = std::chrono::steady_clock;
double since_ms(Clock::time_point then) {
  return std::chrono::duration<double, std::milli>(Clock::now() - then).count();
}

/// A thread that naps, and how late it woke at worst, and how late a byte came through a line.
class Sleeper {
 public:
  explicit Sleeper(int fifo_priority) : thread_([this, fifo_priority] { nap_until_end(fifo_priority); }) {}
  ~Sleeper() {
    ends_ = true;
    thread_.join();
  }
  Sleeper(const Sleeper&) = delete;
  Sleeper& operator=(const Sleeper&) = delete;

  /// 0: the priority was refused.
  [[nodiscard]] double worst_ms() const { return worst_ms_; }
  [[nodiscard]] double worst_handed_on_ms() const { return worst_handed_on_ms_; }

 private:
  void nap_until_end(int fifo_priority) {
    const sched_param priority{fifo_priority};
    if (fifo_priority > 0 && sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority) != 0) return;
    const Line line;
    while (!ends_) {
      const auto due = Clock::now() + std::chrono::nanoseconds(kNap.tv_nsec);
      (void)clock_nanosleep(CLOCK_MONOTONIC, 0, &kNap, nullptr);
      worst_ms_ = std::max(worst_ms_.load(), since_ms(due));
      const auto written = Clock::now();
      line.pass_a_byte();
      worst_handed_on_ms_ = std::max(worst_handed_on_ms_.load(), since_ms(written));
    }
  }
  std::atomic<double> worst_ms_{0}, worst_handed_on_ms_{0};
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

class StandstillWatch final : public testing::EmptyTestEventListener {
  void OnTestStart(const testing::TestInfo&) override {
    real_time_ = std::make_unique<Sleeper>(kProgramsPriority);
    usual_ = std::make_unique<Sleeper>(0);
  }
  void OnTestEnd(const testing::TestInfo& info) override {
    const double real_time_ms = real_time_->worst_ms(), usual_ms = usual_->worst_ms(),
                 handed_on_ms = real_time_->worst_handed_on_ms();
    real_time_.reset();
    usual_.reset();
    if (!info.result()->Failed()) return;
    const std::string words = fmt::format(
        "this computer let a waiting thread wait for {:.0f} ms more at real-time priority (tolerated: {:.0f} ms) and "
        "{:.0f} ms at the usual one (tolerated: {:.0f} ms), and a byte in a pseudo-terminal for {:.0f} ms (tolerated: "
        "{:.0f} ms)",
        real_time_ms, kRealTimeLimit_ms, usual_ms, kUsualLimit_ms, handed_on_ms, kHandedOnLimit_ms);
    fmt::print("{}\n", words);
    if (real_time_ms > kRealTimeLimit_ms || usual_ms > kUsualLimit_ms || handed_on_ms > kHandedOnLimit_ms)
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
