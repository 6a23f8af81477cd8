// The load cell weighed on the deterministic bench.
#include "daq/weigh/weigh.hpp"

#include <gmock/gmock.h>

#include "daq/guard/interlock.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/coasting_bench.hpp"

namespace kphi::daq {
namespace weigh_test {

using testing::HasSubstr;

class Weighed : public testing::Test {
 protected:
  /// The power is off, and the motor coasts, however it ended.
  void TearDown() override {
    if (!bench_) return;
    EXPECT_EQ(bench_->bench.simulation().motor().stage().mode, sim::PowerStage::Mode::coast);
    EXPECT_FALSE(bench_->bench.simulation().supply()->circuit().output());
  }
  CoastingBench& bench(double gain = 1, double hysteresis = 0, const std::string& faults = {}) {
    config_ = test::with_supply(test::deterministic_config(4, faults));
    config_.simulation->stand.cell_gain = gain;
    config_.simulation->stand.cell_hysteresis = hysteresis;
    bench_.emplace(config_);
    return *bench_;
  }
  results::Weighing weigh_half_a_kilo(double kg = 0.5, int axis = 2) {
    results::Weighing weighing;
    weighing.bench = "test";
    weighing.mass_kg = kg;
    weighing.mass_u_kg = 1e-5;
    weighing.gravity_u_m_s2 = 1e-4;
    weighing.axis = axis;
    return weigh({*bench_, said_, stop_asked_, keys_.press ? &keys_ : nullptr, weighing, 3, std::chrono::seconds(2)});
  }
  profiles::BenchConfig config_;
  std::optional<CoastingBench> bench_;
  test::SaidLines said_;
  std::function<bool()> stop_asked_ = test::never;
  test::PressedKeys keys_{{}};
};

TEST_F(Weighed, FindsTheGainOfTheCellWithinItsUncertainty) {
  bench(1.01);
  const results::Weighing weighing = weigh_half_a_kilo();
  ASSERT_EQ(weighing.levels.size(), 7u);
  EXPECT_EQ(weighing.cell_serial, "FT21001");
  const results::CellCheck check = check_of(weighing);
  EXPECT_NEAR(check.gain.value, 1.01, check.gain.expanded());
  EXPECT_LT(check.gain.expanded(), 0.001) << "1.0 ± 0.1 %";
  EXPECT_NEAR(check.crosstalk[0].value, 0.004, 2e-4) << "of the simulated cell";
  EXPECT_NEAR(check.crosstalk[1].value, -0.003, 2e-4);
}

TEST_F(Weighed, FindsTheHysteresisAndAnotherAxis) {
  bench(0.995, 0.004);
  const results::CellCheck check = check_of(weigh_half_a_kilo(0.5, 0));
  EXPECT_NEAR(check.hysteresis.value, 0.004, 5e-4);
  EXPECT_NEAR(check.gain.value, 0.995, check.gain.expanded());
}

TEST_F(Weighed, AsksForTheMassOffAndOnAndGoesOnAtTheKeyAlone) {
  bench();
  int presses = 0;
  Instant asked{};
  keys_.press = [&]() -> std::optional<Key> {
    if (asked == Instant{}) asked = bench_->clock().now();
    if (bench_->clock().now() - asked < std::chrono::seconds(5)) return std::nullopt;
    asked = Instant{};
    ++presses;
    return presses == 1 ? Key::up : Key::hold;  // any but Enter does not count
  };
  EXPECT_EQ(weigh_half_a_kilo().levels.size(), 7u);
  EXPECT_EQ(presses, 8);
  EXPECT_EQ(keys_.forgotten, 7) << "keys pressed before a question do not answer it";
  EXPECT_EQ(said_.count("Take everything off; then press Enter."), 4);
  EXPECT_EQ(said_.count("Put 0.5 kg on, so that it pulls along z; then press Enter."), 3);
  EXPECT_EQ(said_.count("the supply's output is off"), 1);
}

TEST_F(Weighed, AsksAgainWhenTheMassCannotBeOn) {
  bench(0.4);  // reads two fifths: as if another mass were on
  int presses = 0;
  keys_.press = [&]() -> std::optional<Key> { return ++presses < 4 ? Key::hold : Key::stop; };
  EXPECT_THROW((void)weigh_half_a_kilo(), Interrupted);
  EXPECT_EQ(said_.count("is that mass on, and along z?"), 2);
  EXPECT_EQ(said_.count("Put 0.5 kg on"), 3);
}

TEST_F(Weighed, RefusesAMassThatCannotBeOnWithoutSomebodyToAsk) {
  bench(0.4);
  EXPECT_THAT(test::words_of<DataRejected>([&] { return weigh_half_a_kilo(); }), HasSubstr("is that mass on"));
}

TEST_F(Weighed, RefusesMoreThanTheCellBears) {
  bench();
  EXPECT_THAT(test::words_of<ConfigurationError>([&] { return weigh_half_a_kilo(30); }),
              HasSubstr("30 kg weigh 294.2 N; z of this cell ends at"));
}

TEST_F(Weighed, StopsAtAnotherKeyOrASignal) {
  bench();
  keys_.press = [] { return std::optional(Key::stop); };
  EXPECT_THAT(test::words_of<Interrupted>([&] { return weigh_half_a_kilo(); }), HasSubstr("stopped by a key"));
  int calls = 0;
  stop_asked_ = [&] { return ++calls > 100; };
  keys_.press = {};
  EXPECT_THROW((void)weigh_half_a_kilo(), Interrupted);
}

TEST_F(Weighed, StopsWhenThePowerComesBackWhileSomebodyIsNear) {
  bench();
  bench_->spoilt_supply->spoil = [&](SupplyReading& reading) {
    if (said_.count("Put ") == 1) reading.output = 1;
  };
  keys_.press = [] { return std::optional(Key::hold); };
  EXPECT_THAT(test::words_of<SafetyStop>([&] { return weigh_half_a_kilo(); }),
              HasSubstr("output is on while somebody may be near"));
}

TEST_F(Weighed, SaysThatTheLoadDoesNotComeToRest) {
  bench();
  keys_.press = {};
  double swings = 0;
  said_.at_tick = [&](const Position&, const Observation&) {
    bench_->bench.hung(2, swings += 0.01);  // somebody pours sand
  };
  EXPECT_THAT(test::words_of<DataRejected>([&] { return weigh_half_a_kilo(); }), HasSubstr("does not come to rest"));
}

TEST_F(Weighed, FailsWithTheStream) {
  const test::TemporaryFolder folder;
  const std::string script = (folder.path() / "faults.yaml").string();
  std::ofstream(script) << "format: kphi-faults/1\nfaults:\n  - {at_s: 10, for_s: 3600, kind: stall}\n";
  bench(1, 0, script);
  EXPECT_THROW((void)weigh_half_a_kilo(), DeviceError);
}

TEST(DescribeWeighing, ShowsWhatIsAskedAndTheLoad) {
  Position position;
  position.phase = kPutOn;
  position.repetition = 2;
  position.repetitions = 3;
  Observation seen;
  seen.thrust_n = 4.9031;
  EXPECT_EQ(describe_weighing(position, seen), "  mass on  2/3     4.903 N");
  seen.load_cell_age = std::chrono::seconds(5);
  EXPECT_EQ(describe_weighing(position, seen), "  mass on  2/3         ? N");
}

}  // namespace weigh_test
}  // namespace kphi::daq
