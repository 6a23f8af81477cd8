// Drivers that are not kphi's own, each against the other end of its wire, and a campaign through kphi run and kphi
// fit.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include "base/error.hpp"
#include "drivers/sim/control_line.hpp"
#include "examples/second_bench/checked_lines.hpp"
#include "examples/second_bench/esc_motor.hpp"
#include "examples/second_bench/offer.hpp"
#include "examples/second_bench/serial_scale.hpp"
#include "profiles/strict_yaml.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/end_to_end/program.hpp"
#include "test/end_to_end/terminal.hpp"
#include "test/soon.hpp"
#include "test/source_dir.hpp"

namespace kphi::second_bench {
namespace second_bench_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::kphi;
using test::ran;
using test::soon;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(CheckedLines, AreReadInAnyPiecesAndCountedWhereTheirFormOrSumIsWrong) {
  EXPECT_EQ(checked("T,48"), "$T,48*74\n");
  const std::string good = checked("L,7,-12345");
  CheckedLines lines;
  for (const char c : good) lines.take({&c, 1});
  EXPECT_THAT(lines.next('L', 2), testing::Optional(ElementsAre(7, -12345)));
  for (const std::string& bad : {std::string("\n"), std::string("$L,1,2*00\n"), checked("L,1"), checked("R,1,2"),
                                 checked("L,1,x"), checked("L,,2"), std::string("noise\n"), std::string(500, 'x')})
    lines.take(bad);
  EXPECT_EQ(lines.next('L', 2), std::nullopt);
  EXPECT_EQ(lines.malformed(), 8u);
  lines.take(good);
  EXPECT_THAT(lines.next('L', 2), testing::Optional(ElementsAre(7, -12345)));
}

TEST(SpeedLoop, GivesWhatTheSpeedNeedsThenCorrectsAndNeverWindsUp) {
  SpeedLoop loop({.pole_pairs = 7, .kv_rad_s_per_v = 230, .proportional = 0.5, .integral = 4});
  EXPECT_NEAR(loop.throttle(1150, 1150, 10, 0.01), 1000, 1);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(loop.throttle(5000, 100, 10, 0.01), 2000) << "all it has";
  EXPECT_NEAR(loop.throttle(1150, 1150, 10, 0.01), 1000, 1) << "and no memory of it";
  EXPECT_EQ(loop.throttle(1, 4000, 10, 0.01), 48) << "never coasting by itself";
}

/// The simulated stand, and the bench file with its paths.
class Stand : public testing::Test {
 protected:
  explicit Stand(bool supply = false)
      : process_(supply
                     ? std::vector<std::string>{KPHI_STAND, path("scale"), path("esc"), path("control"), path("supply")}
                     : std::vector<std::string>{KPHI_STAND, path("scale"), path("esc"), path("control")}) {
    process_.wait_for("ready");
    std::string text = profiles::read_text(test::source_dir() + "/examples/second_bench/bench.yaml");
    for (std::size_t at; (at = text.find("/tmp/second/")) != std::string::npos;)
      text.replace(at, 11, folder_.path().string());
    if (supply)
      text += "supply: {uri: \"modbus-rtu:" + path("supply") +
              "?model=RD6024\", voltage_v: 12, current_limit_a: 24, over_voltage_v: 14, over_current_a: 24}\n";
    test::write(path("bench.yaml"), text);
    bench_ = profiles::load_bench(path("bench.yaml"));
    (void)tell("mount 5x3 0");
  }
  ~Stand() override {
    process_.signal(SIGTERM);
    EXPECT_EQ(process_.wait(), 0);
  }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string tell(const std::string& line) { return sim::tell(path("control"), line); }
  [[nodiscard]] int throttle() { return std::stoi(tell("status").substr(3)); }
  [[nodiscard]] double rpm() {
    const std::string words = tell("status");
    return std::stod(words.substr(words.rfind(' ')));
  }

  test::TemporaryFolder folder_;
  test::Process process_;
  profiles::BenchConfig bench_;
  SteadyClock clock_;
};

class Scale : public Stand {};

TEST_F(Scale, DeliversEachConversionOnceInItsAxis) {
  SerialScale scale(bench_, clock_);
  const results::LoadCellScale told = scale.start();
  EXPECT_EQ(told.counts_per_newton, 20000);
  EXPECT_THAT(told.range, ElementsAre(0, 0, 50, 0, 0, 0));
  std::vector<LoadCellRecord> got;
  ASSERT_TRUE(soon([&] {
    std::array<LoadCellRecord, 64> some{};
    got.insert(got.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(scale.take(some)));
    return got.size() >= 40;
  }));
  for (std::size_t i = 1; i < got.size(); ++i) {
    EXPECT_EQ(got[i].ft_sequence, got[i - 1].ft_sequence + 1);
    EXPECT_EQ(got[i].rdt_sequence, i + 1);
    EXPECT_NE(got[i].counts[2], 0);
    EXPECT_EQ(got[i].counts[0], 0);
  }
  scale.stop();
  const SampleAccount account = scale.account();
  EXPECT_EQ(account.expected, account.received);
  EXPECT_EQ(scale.failure(), "");
}

TEST_F(Scale, SaysThatItsBoardIsSilent) {
  SerialScale scale(bench_, clock_);
  (void)scale.start();
  (void)tell("mute scale");
  EXPECT_TRUE(soon([&] { return scale.failure().find("no line for") != std::string::npos; }));
  EXPECT_THAT(test::words_of<DeviceError>([&] { return SerialScale(bench_, clock_); }), HasSubstr("in use"));
}

TEST_F(Scale, RefusesASilentBoardAndSettingsThatItDoesNotKnow) {
  (void)tell("mute scale");
  EXPECT_THAT(test::words_of<DeviceError>([&] { return std::make_unique<SerialScale>(bench_, clock_); }),
              HasSubstr("none came within 2 s"));
  bench_.load_cell->settings["gain"] = 1;
  EXPECT_THAT(test::words_of<ConfigurationError>([&] { return std::make_unique<SerialScale>(bench_, clock_); }),
              HasSubstr("it knows counts_per_newton, range_n"));
}

class Esc : public Stand {
 protected:
  void spin_up(EscMotor& motor) {
    ASSERT_TRUE(soon([&] {
      motor.spin_at(from_rpm(6000));
      return std::abs(rpm() - 6000) < 100;
    }));
  }
  /// Whether the board sends throttle 0 soon, whatever it was told last.
  bool coasts() {
    return soon([&] { return throttle() == 0; });
  }
};

TEST_F(Esc, HoldsASpeedAndReportsIt) {
  EscMotor motor(bench_, clock_);
  spin_up(motor);
  double newest = 0;
  ASSERT_TRUE(soon([&] {
    motor.renew();
    std::array<MotorReading, 64> readings;
    const std::size_t n = motor.take(readings);
    for (std::size_t i = 0; i < n; ++i)
      if (readings[i].channel == MotorChannel::speed) newest = to_rpm(RadPerSec(readings[i].value));
    return std::abs(newest - 6000) < 30;
  }));
  EXPECT_EQ(motor.failure(), "");
}

TEST_F(Esc, CoastsAtAnEmergencyStopAndAtSpeedZero) {
  EscMotor motor(bench_, clock_);
  spin_up(motor);
  motor.emergency_stop();
  EXPECT_TRUE(coasts());
  ASSERT_TRUE(soon([&] { return rpm() < 10; }));
  spin_up(motor);
  motor.spin_at(RadPerSec(0));
  EXPECT_TRUE(coasts());
}

TEST_F(Esc, StopsAndReportsThatTheRotorIsAtRest) {
  EscMotor motor(bench_, clock_);
  spin_up(motor);
  motor.begin_stop({});
  ASSERT_TRUE(soon([&] { return motor.stop_report().has_value(); }));
  EXPECT_EQ(motor.stop_report()->outcome, iq::StopReport::Outcome::standing);
  EXPECT_LT(rpm(), 150);
}

TEST_F(Esc, CoastsWhenNobodyRenewsItsLease) {
  EscMotor motor(bench_, clock_);
  spin_up(motor);
  EXPECT_TRUE(coasts());
  EXPECT_THAT(motor.failure(), HasSubstr("did not renew"));
  EXPECT_THROW(motor.spin_at(from_rpm(6000)), DeviceError);
  const auto events = motor.take_events();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::motor_lease_expired);
}

TEST_F(Esc, CoastsWhenItIsDestroyed) {
  {
    EscMotor motor(bench_, clock_);
    spin_up(motor);
  }
  EXPECT_TRUE(coasts());
}

TEST_F(Esc, SaysThatItsBoardIsSilent) {
  EscMotor motor(bench_, clock_);
  spin_up(motor);
  (void)tell("mute esc");
  EXPECT_TRUE(soon([&] {
    motor.renew();
    return motor.failure().find("said nothing for 0.2 s") != std::string::npos;
  })) << motor.failure();
}

class SecondBench : public Stand {
 protected:
  using Stand::Stand;
  [[nodiscard]] std::vector<std::string> command(const std::string& campaign) {
    test::write(path("campaign.yaml"), campaign);
    return {kphi(), "run", path("campaign.yaml"), "--bench", path("bench.yaml"), "--yes", "--out", path("out")};
  }
};

TEST_F(SecondBench, IsCheckedAndItsDevicesTellOfThemselves) {
  EXPECT_THAT(ran({kphi(), "check", path("bench.yaml")}).out, HasSubstr("load cell  hx711"));
  const auto devices = ran({kphi(), "devices", "--bench", path("bench.yaml")});
  EXPECT_THAT(devices.out, HasSubstr("hx711, 80 Hz, 20000 counts/N"));
  EXPECT_THAT(devices.out, HasSubstr("ESC on "));
}

TEST_F(SecondBench, RunsACampaignAndFitsWhatTheStandWasBuiltWith) {
  const std::string folder =
      ran(command("format: kphi-campaign/1\nname: short\n"
                  "propeller: {id: 5x3, name: 5-inch three-blade, diameter_in: 5, blades: 3}\n"
                  "occlusions_deg: [0, 90, 180]\nrepetitions: 1\nrepetitions_extra_max: 0\n"
                  "profile: {steps: 4, dwell_s: 2, first_rpm: 6000, last_rpm: 16000, slew_rpm_s: 8000}\n"
                  "zero_s: 1\nminimum_discard_s: 1\nsupply_v: 12.0\n"
                  "limits: {speed_max_rpm: 19100, thrust_max_n: 20, supply_current_max_a: 35, "
                  "coil_temperature_max_degc: 110}\n"))
          .folder();
  (void)ran({kphi(), "fit", "--accept", "--no-report", folder});
  EXPECT_THAT(ran({kphi(), "verify", folder}).out, HasSubstr("intact: 3 runs"));
  const auto file = YAML::LoadFile(folder + "/coefficients.yaml");
  const double expanded = file["K_T"]["expanded_95"].as<double>();
  EXPECT_NEAR(file["K_T"]["value"].as<double>(), test::kTrueK5x3, std::max(2 * expanded, 0.003 * test::kTrueK5x3));
  EXPECT_LT(expanded, 0.02 * test::kTrueK5x3) << "of which 1.7 % are assumed";
}

TEST_F(SecondBench, StopsAndCoastsWhenTheScaleFallsSilentInARun) {
  test::Process run(command(test::short_campaign_text("0", 1, 40)));
  ASSERT_TRUE(soon([&] { return rpm() > 5000; }));
  (void)tell("mute scale");
  EXPECT_TRUE(soon([&] { return throttle() == 0; }));
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_THAT(run.err(), AnyOf(HasSubstr("load-cell sample"), HasSubstr("load cell: no line"))) << "whichever is first";
}

TEST_F(SecondBench, StopsAndCoastsWhenTheScaleRepeatsOneValue) {
  test::Process run(command(test::short_campaign_text("0", 1, 40)));
  ASSERT_TRUE(soon([&] { return rpm() > 5000; }));
  (void)tell("freeze scale");
  EXPECT_TRUE(soon([&] { return throttle() == 0; }));
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("repeats one value"));
}

TEST_F(SecondBench, TurnsNothingOverAScaleThatRepeatsOneValueFromTheStart) {
  (void)tell("freeze scale");
  test::Process run(command(test::short_campaign_text("0", 1, 40)));
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("repeated one value in all"));
  EXPECT_LT(rpm(), 10);
}

TEST_F(SecondBench, CoastsByItsBoardWhenKphiIsKilled) {
  test::Process run(command(test::short_campaign_text("0", 1, 40)));
  ASSERT_TRUE(soon([&] { return rpm() > 5000; }));
  run.signal(SIGKILL);
  (void)run.wait();
  EXPECT_TRUE(soon([&] { return throttle() == 0; }));
}

TEST_F(SecondBench, NeverTurnsAgainAMotorThatItsBoardLetGoWhileKphiStoodStill) {
  test::Process run(command(test::short_campaign_text("0", 1, 40)));
  ASSERT_TRUE(soon([&] { return rpm() > 5000; }));
  ASSERT_TRUE(run.freeze());
  ASSERT_TRUE(soon([&] { return throttle() == 0; }));
  run.signal(SIGCONT);  // at once: before the lease is over, and the guard's patience
  while (run.hear(milliseconds(5))) ASSERT_EQ(throttle(), 0) << run.err();
  EXPECT_EQ(run.wait(), 4) << run.err();
}

/// Its ESC's board lives on what the supply gives.
class SuppliedBench : public SecondBench {
 protected:
  SuppliedBench() : SecondBench(true) {}
  [[nodiscard]] std::vector<std::string> devices(const std::vector<std::string>& more = {}) const {
    return test::joined({kphi(), "devices", "--bench", path("bench.yaml")}, more);
  }
  [[nodiscard]] double rpm_after(const std::string& campaign) {
    EXPECT_EQ(test::Process(command(campaign)).wait(), 0);
    return rpm();
  }
};

TEST_F(SuppliedBench, IsAskedWithItsSupplySwitchedOnWhereAPersonWantsThat) {
  const auto unasked = ran(devices());
  EXPECT_THAT(unasked.out, HasSubstr("without power"));
  EXPECT_THAT(unasked.out, HasSubstr("give --switch-on to ask it"));
  for (const char* answer : {"no", "on"}) {
    test::Terminal terminal;
    test::Process asked(devices(), {}, {{}, terminal.descriptor(), 0});
    asked.wait_for_prompt({"or only Enter: "});
    terminal.type(answer);
    EXPECT_EQ(asked.wait(), 0) << asked.err();
    EXPECT_EQ(asked.out().find("ESC on ") != std::string::npos, answer == std::string("on")) << asked.out();
  }
  const auto switched = ran(devices({"--switch-on"}));
  EXPECT_THAT(switched.out, HasSubstr("the supply's output was on to ask it, and is off again"));
  EXPECT_THAT(ran(devices({"--json"})).out, HasSubstr("\"output\": false"));
  EXPECT_LT(rpm(), 1);
}

TEST_F(SuppliedBench, RunsWithTheSupplyOnAndEndsWithItOff) {
  EXPECT_LT(rpm_after(test::short_campaign_text("0", 1, 3)), 1000);
  EXPECT_THAT(ran(devices({"--json"})).out, HasSubstr("\"output\": false"));
}

TEST_F(SecondBench, NamesTheDriversThatThereAreWhereOneIsUnknown) {
  std::string text = profiles::read_text(path("bench.yaml"));
  test::write(path("bench.yaml"), text.replace(text.find("driver: esc"), 11, "driver: esk"));
  EXPECT_THAT(ran({kphi(), "devices", "--bench", path("bench.yaml")}, 2).err,
              HasSubstr("motor.driver: esk is unknown; this kphi has esc"));
}

}  // namespace second_bench_test
}  // namespace kphi::second_bench
