// The calendar clock of the computer steps in the midst of a run: a board without a battery clock, a laptop that meets
// a network. The kernel stamps datagrams by it.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/mman.h>

#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"
#include "test/end_to_end/running_bench.hpp"

namespace kphi::test::clock_step_test {

/// By how much the clock of a program has stepped so far.
class Step {
 public:
  explicit Step(const std::string& file) : file_(file) {
    write(file, std::string(8, '\0'));
    const int descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
    page_ =
        static_cast<std::atomic<std::int64_t>*>(::mmap(nullptr, 8, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0));
    ::close(descriptor);
  }
  ~Step() { ::munmap(page_, 8); }
  Step(const Step&) = delete;
  Step& operator=(const Step&) = delete;
  void by(double seconds) { *page_ = static_cast<std::int64_t>(1e9 * seconds); }
  [[nodiscard]] std::vector<std::string> environment() const {
    return {std::string("LD_PRELOAD=") + KPHI_SLEEPING_CLOCK, "KPHI_STEPPED=" + file_};
  }

 private:
  std::string file_;
  std::atomic<std::int64_t>* page_ = nullptr;
};

struct Trial {
  const char* name;
  double seconds;
  int records;  ///< in a datagram
};

std::ostream& operator<<(std::ostream& out, const Trial& trial) { return out << trial.name; }

class CalendarClock : public testing::TestWithParam<Trial> {};

TEST_P(CalendarClock, MovesNoSampleWhenItSteps) {
  const Trial& trial = GetParam();
  RunningBench bench(Manner{.time_scale = 1, .rate_hz = 1000});
  std::string text = bytes_of(bench.path("bench.yaml"));
  text.replace(text.find("records_per_datagram: 40"), 24, fmt::format("records_per_datagram: {}", trial.records));
  write(bench.path("bench.yaml"), text);
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 3));
  Step step(bench.path("stepped"));
  Process run(bench.run_command(), {}, {step.environment(), -1, 0});
  ASSERT_TRUE(bench.await_speed(900)) << run.err();
  step.by(trial.seconds);
  EXPECT_EQ(run.wait(), 0) << run.err();
  const std::filesystem::path folder = run.out().substr(0, run.out().find('\n'));
  const auto file = results::CampaignFolder::open(folder).complete_runs().at(0);
  EXPECT_LT(std::filesystem::file_size(file), 10e6);
  for (const results::StepMean& one : results::reduce(results::read_run(file))) {
    EXPECT_EQ(results::quality_flag_names(one.quality_flags), "") << one.step;
    EXPECT_NEAR(one.thrust_n / (one.speed_rad_s * one.speed_rad_s), kTrueK5x3, 0.03 * kTrueK5x3) << one.step;
  }
}

constexpr double kDay = 86400;
constexpr Trial kTrials[] = {
    {"TenthBack", -0.1, 1},
    {"TenthOn", 0.1, 1},
    {"HourBack", -3600, 1},
    {"HourOn", 3600, 1},
    {"YearsOn", 600 * kDay, 1},
    {"YearsBack", -600 * kDay, 40},
    {"YearsOnOfMany", 600 * kDay, 40},
};
INSTANTIATE_TEST_SUITE_P(By, CalendarClock, testing::ValuesIn(kTrials),
                         [](const auto& trial) { return std::string(trial.param.name); });

}  // namespace kphi::test::clock_step_test
