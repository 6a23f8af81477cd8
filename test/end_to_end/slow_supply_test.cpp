// A supply as slow as stock firmware, 10 answers a second over a true pseudo-terminal, some of them so late that nobody
// waits for them any more, beside 7000 load-cell samples a second over true UDP.
#include <gmock/gmock.h>
#include <signal.h>

#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"
#include "test/drivers/sim_equipment/scpi_tcp.hpp"
#include "test/end_to_end/running_bench.hpp"

namespace kphi::test::slow_supply_test {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr double kTimeout = 0.7;  // s: what the driver waits for an answer

/// An answer that leaves 50 ms after the driver has given up, with 11 V in it, which no other answer has.
std::string late_answer(double at_s) {
  return fmt::format(
      "  - {{at_s: {0}, count: 1, kind: supply_late, delay_s: {1}}}\n"
      "  - {{at_s: {0}, for_s: 0.3, kind: supply_reads_as, register: 10, value: 1100}}\n",
      at_s, kTimeout + 0.05);
}

std::filesystem::path the_run_in(const std::filesystem::path& results) {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(results)) {
    if (entry.path().string().ends_with("rep1.h5")) return entry.path();
  }
  return {};
}

TEST(SlowSupply, DisturbsNothingAndNoneOfItsLateAnswersBecomesAValue) {
  std::string late_answers;  // until long after the slowest build has begun its run
  for (int i = 0; i < 20; ++i) late_answers += late_answer(2.2 + 1.4 * i);
  RunningBench bench({1, 7000, late_answers, true});
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 6));
  Process run(bench.run_command());
  ASSERT_EQ(run.wait(), 0) << run.err();
  const results::RunRecording kept = results::read_run(the_run_in(bench.path("results")));

  EXPECT_EQ(kept.account.lost_network + kept.account.lost_host, 0u);
  for (std::size_t i = 0; i + 1 < kept.phases.size(); ++i) {
    if (kept.phases[i].phase != results::Phase::step) continue;
    const double lasted = 1e-9 * static_cast<double>(kept.phases[i + 1].time_ns - kept.phases[i].time_ns);
    EXPECT_NEAR(lasted, 0.6, 0.1) << "step " << kept.phases[i].step;
  }

  ASSERT_GT(kept.supply.size(), 8u);
  std::int64_t longest = 0;
  for (std::size_t i = 0; i < kept.supply.size(); ++i) {
    EXPECT_GT(kept.supply[i].voltage_v, 10) << "a late answer; a step up may load the supply down to 10.9 V";
    EXPECT_EQ(kept.supply[i].set_voltage_v, 12);
    if (i > 0) longest = std::max(longest, kept.supply[i].time_ns - kept.supply[i - 1].time_ns);
  }
  EXPECT_GT(longest, static_cast<std::int64_t>(kTimeout * kSecond)) << "no answer was late: this test showed nothing";
}

/// Every answer takes 0.45 s, as of stock firmware 1.40.
TEST(SlowSupply, ThatTakesHalfASecondForEveryAnswerIsAskedLessOftenAndCarriesARun) {
  RunningBench bench({1, 7000, "  - {at_s: 0, for_s: 1000, kind: supply_late, delay_s: 0.45}\n", true});
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 6));
  Process run(bench.run_command());
  ASSERT_EQ(run.wait(), 0) << run.err();
  const results::RunRecording kept = results::read_run(the_run_in(bench.path("results")));
  ASSERT_GT(kept.supply.size(), 3u);
  for (std::size_t i = 1; i < kept.supply.size(); ++i)
    EXPECT_GT(kept.supply[i].time_ns - kept.supply[i - 1].time_ns, kSecond / 2) << "its line is left alone meanwhile";
  EXPECT_TRUE(bench.account().ends_without_power());
}

TEST(SlowSupply, OfAKilledProgramIsSwitchedOffAllTheSame) {
  RunningBench bench({1, 7000, "  - {at_s: 0, for_s: 1000, kind: supply_late, delay_s: 0.45}\n", true});
  Process run(bench.run_command());
  ASSERT_TRUE(bench.await_speed(500)) << run.err();
  run.signal(SIGKILL);
  EXPECT_TRUE(bench.await([](const auto& now) { return now["supply"]["output"] == false; }, std::chrono::seconds(5)));
  EXPECT_EQ(run.wait(), 128 + SIGKILL);
}

/// A SCPI supply over TCP beside a simulated bench.
class SlowInstrument : public testing::Test {
 protected:
  /// Each answer takes so long from now on.
  void answer_after(double seconds) {
    sim::Fault late{sim::FaultKind::ambient_late, {}, from_seconds(1e6), 0};
    late.delay = from_seconds(seconds);
    faults.set({late});
  }
  Process run() {
    instrument.connect_load(6);
    write(bench.path("scpi.yaml"), bytes_of(bench.path("bench.yaml")) +
                                       fmt::format("supply: {{uri: \"scpi-tcp:127.0.0.1:{}\", voltage_v: 12, "
                                                   "current_limit_a: 8, over_voltage_v: 14, over_current_a: 9}}\n",
                                                   server.port()));
    write(bench.path("short.yaml"), short_campaign_text("0", 1, 6));
    return Process(in_real_time({kphi(), "run", bench.path("short.yaml"), "--bench", bench.path("scpi.yaml"), "--yes",
                                 "--out", bench.path("results")}));
  }
  [[nodiscard]] static sim::ScpiType of_a_plain_maker() {
    sim::ScpiType type;
    type.plain_errors = true;
    return type;
  }
  SteadyClock clock;
  sim::UsbFaults faults{clock};
  sim::ScpiInstrument instrument{of_a_plain_maker()};
  sim::ScpiTcp server{instrument, faults};
  RunningBench bench{Manner{1}};
};

TEST_F(SlowInstrument, IsReadLessOftenAndCarriesARun) {
  for (const double answer_s : {0.1, 0.45}) {
    answer_after(answer_s);
    Process program = run();
    ASSERT_EQ(program.wait(), 0) << program.err();
    const results::RunRecording kept = results::read_run(the_run_in(bench.path("results")));
    ASSERT_GE(kept.supply.size(), 1u);
    for (const SupplyReading& reading : kept.supply) EXPECT_EQ(reading.voltage_v, 12);
    for (std::size_t i = 1; i < kept.supply.size(); ++i)
      EXPECT_GT(kept.supply[i].time_ns - kept.supply[i - 1].time_ns, static_cast<std::int64_t>(8 * answer_s * kSecond));
    EXPECT_FALSE(instrument.state().output);
    std::filesystem::remove_all(bench.path("results"));
  }
}

TEST_F(SlowInstrument, IsSwitchedOffAfterOneAnswerNotAfterAReading) {
  answer_after(0.45);
  Process program = run();
  program.wait_for("step  1/");  // connecting alone takes some twenty seconds
  program.signal(SIGINT);
  const auto asked = std::chrono::steady_clock::now();
  while (instrument.state().output) ASSERT_TRUE(program.hear(std::chrono::milliseconds(5))) << program.err();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - asked;
  EXPECT_EQ(program.wait(), 130) << program.err();
  EXPECT_LT(took.count(), 1.0) << "a reading takes 3.6 s";
  EXPECT_THAT(program.err(), testing::HasSubstr("supply: output off"));
}

/// It becomes so slow with its output on that no reading of the voltage is there in time.
TEST_F(SlowInstrument, WhoseVoltageWasNotReadIsNotSaidToGiveZeroVolts) {
  Process program = run();
  while (!instrument.state().output) ASSERT_TRUE(program.hear(std::chrono::milliseconds(1))) << program.err();
  answer_after(0.85);  // a line waits one second for an answer
  EXPECT_EQ(program.wait(), 3) << program.err();
  EXPECT_THAT(program.err(), testing::HasSubstr("its voltage was not read within 3"));
  EXPECT_THAT(program.err(), testing::Not(testing::HasSubstr("at the terminals")));
  EXPECT_FALSE(instrument.state().output);
}

}  // namespace kphi::test::slow_supply_test
