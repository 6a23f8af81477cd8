// Any thread of a run that stands still for good, or two, each in turn: the motor coasts all the same, and nothing
// keeps it turning until somebody notices.
#include <gmock/gmock.h>
#include <sys/ptrace.h>
#include <sys/wait.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "test/end_to_end/running_bench.hpp"

namespace kphi::test::frozen_thread_test {

/// Of the test's own questions, and of a busy host; a sanitizer's kphi has more patience.
double slack_ms() { return kphi_is_of_another_build() ? 1000 : 150; }
const char* const kRunner = "kphi";
const char* const kCampaign =
    "format: kphi-campaign/1\nname: short\n"
    "propeller: {id: 5x3, name: 5-inch three-blade, diameter_in: 5, blades: 3}\n"
    "occlusions_deg: [0, 180]\nrepetitions: 1\nrepetitions_extra_max: 0\n"
    "profile: {steps: 2, dwell_s: 20, first_rpm: 6000, last_rpm: 9000}\n"
    "zero_s: 0.5\nminimum_discard_s: 0.3\nsupply_v: 12.0\n"
    "limits: {speed_max_rpm: 19100, thrust_max_n: 20, supply_current_max_a: 35, coil_temperature_max_degc: 110}\n";

/// One thread of another process, frozen while this lives. The calling thread stays its tracer.
class Frozen {
 public:
  explicit Frozen(pid_t thread) : thread_(thread) {
    if (::ptrace(PTRACE_SEIZE, thread, nullptr, nullptr) != 0 ||
        ::ptrace(PTRACE_INTERRUPT, thread, nullptr, nullptr) != 0)
      throw std::system_error(errno, std::generic_category(), "ptrace");
    while (::waitpid(thread, nullptr, __WALL) < 0 && errno == EINTR) {
    }
  }
  Frozen(Frozen&& other) noexcept : thread_(std::exchange(other.thread_, 0)) {}
  Frozen& operator=(Frozen&&) = delete;
  ~Frozen() {
    if (thread_ != 0) ::ptrace(PTRACE_DETACH, thread_, nullptr, nullptr);
  }

 private:
  pid_t thread_;
};

/// `name` as `top -H` shows it; the program's own is its main thread's (a sanitizer has one of that name as well).
std::vector<Frozen> freeze(int process, const std::string& name) {
  std::vector<Frozen> frozen;
  for (const auto& task : std::filesystem::directory_iterator(fmt::format("/proc/{}/task", process))) {
    const pid_t thread = std::stoi(task.path().filename());
    const bool is_it = name == kRunner ? thread == process : bytes_of(task.path() / "comm") == name + "\n";
    if (is_it) frozen.emplace_back(thread);
  }
  return frozen;
}

struct Case {
  const char* name;
  std::vector<std::string> threads;
  double limit_ms;    ///< from the freeze until the motor has neither an order to turn nor power
  const char* words;  ///< of the program, once all threads run again
};

std::ostream& operator<<(std::ostream& out, const Case& tested) { return out << tested.name; }

class FrozenThread : public testing::TestWithParam<Case> {};

TEST_P(FrozenThread, DoesNotKeepTheMotorTurning) {
  const Case& tested = GetParam();
  RunningBench bench(Manner{.time_scale = 1, .supply = true});
  write(bench.path("short.yaml"), kCampaign);
  Process run(bench.run_command());
  ASSERT_TRUE(bench.await_speed(600)) << run.err();
  double after_ms = 0;
  {
    std::vector<Frozen> frozen;
    const double at_ms = bench.time_ms();
    for (const std::string& thread : tested.threads)
      for (Frozen& one : freeze(run.pid(), thread)) frozen.push_back(std::move(one));
    ASSERT_EQ(frozen.size(), tested.threads.size());
    double now_ms = 0;
    ASSERT_TRUE(bench.await(
        [&](const auto& now) {
          now_ms = 1e3 * now["bench_time_s"].template get<double>();
          return now["drive"]["mode"] == "coast" || now["supply"]["output"] == false;
        },
        std::chrono::seconds(15)));
    after_ms = now_ms - at_ms;
  }
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_THAT(run.err(), testing::ContainsRegex(tested.words));
  fmt::print("{:<16} lets the motor go {:6.0f} ms after the freeze; wanted {:.0f} ms\n", tested.name, after_ms,
             tested.limit_ms);
  EXPECT_LE(after_ms, tested.limit_ms + slack_ms());
  EXPECT_TRUE(safely(bench.account().ends_without_power()));
}

const Case kCases[] = {
    {"Runner", {kRunner}, 400, "kphi was blocked for"},
    {"Guard", {"guard"}, 400, "the guard was blocked for"},
    {"RunnerAndGuard", {kRunner, "guard"}, 500, "did not renew its command in time|did not run kphi for|blocked for"},
    {"LoadCell", {"load cell"}, 145 + 30, "age of the newest load-cell sample"},
    {"Motor", {"motor"}, 145 + 30, "age of the newest motor reading|did not run kphi"},
    {"MotorAndSupply", {"motor", "supply"}, 500, "motor"},
    {"Supply", {"supply"}, 2000, "age of the newest supply reading"},
    {"Recorder", {"recorder"}, 5000, "kphi could not write to the run file"},
    {"All", {kRunner, "guard", "motor", "supply", "load cell", "recorder"}, 500, "kphi"},
};
INSTANTIATE_TEST_SUITE_P(Each, FrozenThread, testing::ValuesIn(kCases),
                         [](const testing::TestParamInfo<Case>& tested) { return std::string(tested.param.name); });

}  // namespace kphi::test::frozen_thread_test
