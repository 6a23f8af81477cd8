// Every way out of a run ends with the motor coasting, by the simulated motor's own account: within 200 ms of the
// cause; where nothing that the program says reaches the module, within the module's own timeout and 100 ms. Where the
// bench has a supply, its output is off in the end, also if the program was killed.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include "test/end_to_end/running_bench.hpp"

namespace kphi::test::ways_out_test {

using testing::ContainsRegex;

constexpr double kPrompt = 200;                // ms
constexpr double kModuleAlone = 600;           // ms: it is told 0.5 s
constexpr double kStrayed = 250;               // ms: 100 of patience, 60 for a slow host, a reading, and then 50
constexpr double kStrikesAt[]{1.8, 3.6, 6.0};  // s, bench time of a scripted fault; the later ones for a busy host
constexpr int kSteps = 8;
constexpr double kFullSpeed = 0.99 * 19100 * 2 * 3.14159265358979 / 60;  // rad/s
constexpr int kKilledBy = 128;
constexpr int kInterrupted = 130;

/// The program under test and the bench it runs on.
struct Scene {
  RunningBench& bench;
  Process& run;
  const char* supply_fault;
  double& cause_ms;
  void await_coast() const {
    (void)bench.await([](const auto& now) { return now["drive"]["mode"] == "coast"; }, std::chrono::seconds(10));
  }
  /// By the sentinel, where the program was killed.
  void await_power_off() const {
    (void)bench.await(
        [](const auto& now) { return !now["supply"].contains("output") || now["supply"]["output"] == false; },
        std::chrono::seconds(3));
  }
};

template <int... Numbers>
void send(const Scene& scene) {
  (scene.run.signal(Numbers), ...);
}

void stop_until_the_module_coasts(const Scene& scene) {
  scene.run.signal(SIGSTOP);
  scene.await_coast();
  scene.run.signal(SIGCONT);
}

/// From now on no file of the program can grow.
void fill_the_disk(const Scene& scene) {
  const rlimit nothing{1, 1};
  ASSERT_EQ(::prlimit(scene.run.pid(), RLIMIT_FSIZE, &nothing, nullptr), 0);
}

/// In the middle of the step of 19,100 RPM, when the speed has settled.
void let_the_supply_fail(const Scene& scene) {
  (void)scene.bench.await_speed(kFullSpeed);
  const double settles_s = scene.bench.status()["bench_time_s"].get<double>() + 0.4;
  (void)scene.bench.await([&](const auto& now) { return now["bench_time_s"] > settles_s; });
  scene.cause_ms = scene.bench.fault(scene.supply_fault);
}

void close_the_pipes(const Scene& scene) { scene.run.close_pipes(); }

/// The moment from which the milliseconds count.
enum class Cause {
  deed,          ///< what the test does in the second step
  script,        ///< the fault of the bench
  end_of_steps,  ///< where a ramp down ends; on a supply of the bench, which could not sink it, the coast
};

struct Way {
  const char* name;
  Cause cause;
  void (*deed)(const Scene&);
  const char* fault;  ///< entry of a fault script but for its time
  int exit_code;
  const char* words = "";  ///< of the program
  double limit_ms = kPrompt;
  bool heard = true;                   ///< what the program says still reaches the module
  const char* supply_fault = nullptr;  ///< of the bench's own supply, at full speed
  bool switchable = true;              ///< what the program says still reaches the supply
  /// Not where the motor's own electricity is the cause: the protection of a supply would speak first.
  [[nodiscard]] bool has_supply() const {
    const std::string_view text = fault;
    const auto names = [&](const char* word) { return text.find(word) != std::string_view::npos; };
    return !names("volt") && !names("coil") && !names("redline") && !names("brown_out");
  }
};

std::ostream& operator<<(std::ostream& out, const Way& way) { return out << way.name; }

constexpr Way of_supply(const char* name, const char* fault, const char* words, bool switchable = true) {
  Way way{name, Cause::deed, let_the_supply_fail, "", 4, words};
  way.supply_fault = fault;
  way.switchable = switchable;
  return way;
}

constexpr auto kDeed = Cause::deed;
constexpr auto kScript = Cause::script;
constexpr auto kEnd = Cause::end_of_steps;
constexpr const char* kStoppedAndKept = "stopped by request.*this run so far in ";
const Way kWays[] = {
    {"NormalEnd", kEnd, nullptr, "", 0, "next: kphi fit"},
    of_supply("SupplyOverVoltage", "kind=supply_trip code=1", "over-voltage protection switched the output off"),
    of_supply("SupplyOverCurrent", "kind=supply_trip code=2", "over-current protection switched the output off"),
    of_supply("SupplyLimitsTheCurrent", "kind=supply_panel register=9 value=500", "limit"),
    of_supply("SupplySagsALittle", "kind=supply_sag volts=0.8 for_s=1000", "below the 12 V set"),
    of_supply("MainsFail", "kind=supply_sag volts=12 for_s=1000", ""),
    of_supply("SupplyUnplugged", "kind=supply_closed for_s=1000", "supply", false),
    {"Interrupt", kDeed, send<SIGINT>, "", 130, kStoppedAndKept},
    {"InterruptTwice", kDeed, send<SIGINT, SIGINT>, "", 130, "stopped by request"},
    {"Terminate", kDeed, send<SIGTERM>, "", 130, kStoppedAndKept},
    {"HangUp", kDeed, send<SIGHUP>, "", 130, kStoppedAndKept},
    {"QuitKey", kDeed, send<SIGQUIT>, "", 130, "stopped by request"},
    {"NobodyReads", kEnd, close_the_pipes, "", 0, ""},
    {"DiskFull", kDeed, fill_the_disk, "", 1, "File too large"},
    {"Killed", kDeed, send<SIGKILL>, "", kKilledBy + SIGKILL, "", kModuleAlone},
    {"Crashed", kDeed, send<SIGSEGV>, "", kKilledBy + SIGSEGV, "", kModuleAlone},
    {"Frozen", kDeed, stop_until_the_module_coasts, "", 4, "", kModuleAlone},
    {"BoxSilent", kScript, nullptr, "kind: hold, for_s: 1000", 4, "load-cell"},
    {"BoxDead", kScript, nullptr, "kind: reboot, down_s: 1000", 4, "load-cell"},
    {"BoxUnreachable", kScript, nullptr, "kind: address, address: 10.255.255.1, for_s: 1000", 4, "load-cell"},
    {"StreamTakenOver", kScript, nullptr, "kind: taken_over", 4, "another client"},
    {"RangeTrip", kScript, nullptr, "kind: saturation, axes: 4, for_s: 1000", 4, "its range|thrust .* is above"},
    {"BoxError", kScript, nullptr, "kind: status, bits: 0x88000000", 4,
     "the Net Box reports .serial link communication error. .status 0x88000000. for .*cannot be trusted"},
    {"CoilHot", kScript, nullptr, "kind: motor_hot, coil_celsius: 100, for_s: 1000", 4, "coil temperature"},
    {"Derate", kScript, nullptr, "kind: motor_redline, speed_rad_s: 500, for_s: 1000", 4, "derate"},
    {"PowerSafety", kScript, nullptr, "kind: motor_over_voltage, volts: 20, for_s: 1000", 4, "power_safety"},
    {"RotorLocked", kScript, nullptr, "kind: motor_locked, for_s: 1000", 4, "rotor", kStrayed},
    {"SupplySag", kScript, nullptr, "kind: motor_sag, volts: 8.5, for_s: 1000", 4, "power_safety|under-voltage"},
    {"BrownOut", kScript, nullptr, "kind: motor_brown_out, down_s: 0.05", 4, "restarted"},
    {"Unplugged", kScript, nullptr, "kind: motor_unplug, for_s: 1000", 4, "", kPrompt, false},
    {"ModuleUnheard", kScript, nullptr, "kind: motor_mute, for_s: 1000", 4, "motor reading"},
    {"ModuleDeaf", kScript, nullptr, "kind: motor_deaf, for_s: 1000", 4, "", kPrompt, false},
};

std::string campaign_text(const Way& way) {
  const bool full_speed = way.supply_fault != nullptr;
  std::string text = short_campaign_text("0", 1, full_speed ? 5 : kSteps);
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("zero_s: 0.5", "zero_s: 0.2");
  replace("last_rpm: 18000", full_speed ? "last_rpm: 19100" : "last_rpm: 9000");
  if (full_speed) replace("first_rpm: 6000", "first_rpm: 9100");
  if (full_speed) replace("dwell_s: 0.6", "dwell_s: 1.2");
  return text;
}

/// What one run of a way showed.
struct Outcome {
  Account account;
  double cause_ms = 0;
  int exit_code = 0;
  std::string words;
  [[nodiscard]] bool spun_before() const { return account.stage_at(cause_ms - 1) == "drive"; }
};

Outcome take(const Way& way, double fault_at_s) {
  const std::string fault = way.fault;
  RunningBench bench(
      {1, 7000, fault.empty() ? "  []\n" : fmt::format("  - {{at_s: {}, {}}}\n", fault_at_s, fault), way.has_supply()});
  write(bench.path("short.yaml"), campaign_text(way));
  Process run(by_shell(R"(ulimit -c 0; exec "$@")", bench.run_command()));
  Outcome outcome;
  const Scene scene{bench, run, way.supply_fault, outcome.cause_ms};
  if (way.deed != nullptr) {
    run.wait_for("step  1/");
    outcome.cause_ms = bench.time_ms();
    way.deed(scene);
  }
  outcome.exit_code = run.wait();
  outcome.words = run.err();
  scene.await_coast();
  if (way.has_supply() && way.switchable) scene.await_power_off();
  outcome.account = bench.account();
  if (way.cause == Cause::script) outcome.cause_ms = 1e3 * fault_at_s;
  if (way.cause == Cause::end_of_steps)
    outcome.cause_ms = way.has_supply() ? outcome.account.coast_told_at() : outcome.account.last_speed_at() + 1;
  return outcome;
}

/// A fault that struck before the motor turned says nothing: it strikes later then.
Outcome take_while_spinning(const Way& way) {
  Outcome outcome;
  for (const double at_s : kStrikesAt) {
    outcome = take(way, at_s);
    if (way.cause != Cause::script || outcome.spun_before()) break;
  }
  return outcome;
}

class WaysOut : public testing::TestWithParam<Way> {};

TEST_P(WaysOut, EndWithTheMotorCoasting) {
  const Way& way = GetParam();
  const Outcome outcome = take_while_spinning(way);
  const Account& account = outcome.account;
  ASSERT_TRUE(outcome.spun_before()) << outcome.words;
  const double coasts_ms = account.coasts_at() - outcome.cause_ms;
  const double told_ms = account.last_speed_at() - outcome.cause_ms;
  fmt::print("{:<16} coasts {:6.1f} ms after the cause; wanted {:.0f} ms\n", way.name, coasts_ms, way.limit_ms);
  (void)safely(coasts_ms <= way.limit_ms && told_ms <= way.limit_ms);
  EXPECT_LE(coasts_ms, way.limit_ms) << outcome.words;
  EXPECT_LE(told_ms, way.limit_ms) << "it was told to turn again\n" << outcome.words;
  EXPECT_EQ(outcome.exit_code, way.exit_code) << outcome.words;
  if (outcome.exit_code <= kInterrupted && way.heard) {
    EXPECT_EQ(account.commands.back().mode, "coast") << outcome.words;
  }
  EXPECT_THAT(outcome.words, ContainsRegex(way.words));
  if (way.has_supply() && way.switchable) {
    EXPECT_TRUE(safely(account.ends_without_power())) << outcome.words;
  }
}

INSTANTIATE_TEST_SUITE_P(Each, WaysOut, testing::ValuesIn(kWays),
                         [](const testing::TestParamInfo<Way>& way) { return std::string(way.param.name); });

TEST(EndWithPower, IsTold) {
  RunningBench bench(Manner{.time_scale = 4, .supply = true});
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 2));
  Process run(bench.run_command());
  ASSERT_TRUE(bench.await_speed(500)) << run.err();
  (void)bench.fault("kind=supply_ignored_writes for_s=1000");
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_NE(run.err().find("1 runs, "), std::string::npos) << "all is recorded\n" << run.err();
  EXPECT_NE(run.err().find("output NOT confirmed off, it may be ON"), std::string::npos) << run.err();
}

}  // namespace kphi::test::ways_out_test
