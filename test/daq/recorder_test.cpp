#include "daq/recorder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <utility>

#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace {

template <class T>
std::size_t move_out(std::deque<T>& from, std::span<T> out) {
  const std::size_t n = std::min(from.size(), out.size());
  for (std::size_t i = 0; i < n; ++i) {
    out[i] = from.front();
    from.pop_front();
  }
  return n;
}

/// A motor that says what a test puts in.
class QueueMotor final : public MotorLink {
 public:
  void spin_at(RadPerSec) override {}
  void renew() noexcept override {}
  void emergency_stop() noexcept override {}
  void begin_stop(const iq::StopSettings&) override {}
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override { return std::nullopt; }
  [[nodiscard]] const iq::AuditRecord& parameters() const override { return parameters_; }
  [[nodiscard]] std::optional<Celsius> coil_temperature() override { return std::nullopt; }
  std::size_t take(std::span<results::MotorReading> out) override { return move_out(readings, out); }
  [[nodiscard]] std::string identity() const override { return "test"; }
  [[nodiscard]] std::vector<results::StreamEvent> take_events() override { return std::exchange(events, {}); }
  [[nodiscard]] std::string failure() const override { return {}; }

  std::deque<results::MotorReading> readings;
  std::vector<results::StreamEvent> events;

 private:
  iq::AuditRecord parameters_;
};

/// A bench of queues that a test fills.
class QueueBench final : public Bench, private LoadCellLink {
 public:
  [[nodiscard]] const Clock& clock() const override { return time; }
  [[nodiscard]] MotorLink& motor() override { return queue_motor; }
  [[nodiscard]] LoadCellLink& load_cell() override { return *this; }
  void wait_until(Instant when) override { time.set(when); }
  [[nodiscard]] std::unique_ptr<Background> keep_calling(std::function<void()>) override { return nullptr; }
  [[nodiscard]] results::FileLayer& files() override { return *layer; }
  [[nodiscard]] Duration sync_interval() const override { return std::chrono::milliseconds(500); }
  void mounted(const std::string&, double) override {}

  ManualClock time;
  results::FileLayer* layer = &results::disk();
  std::deque<results::LoadCellRecord> records;
  QueueMotor queue_motor;
  std::deque<results::MotorReading>& readings = queue_motor.readings;
  std::vector<results::StreamEvent> events;

 private:
  [[nodiscard]] const netbox::Configuration& configuration() const override { return configuration_; }
  [[nodiscard]] std::vector<netbox::Finding> findings() const override { return {}; }
  results::LoadCellScale start() override { return {}; }
  void stop() noexcept override {}
  std::size_t take(std::span<results::LoadCellRecord> out) override { return move_out(records, out); }
  [[nodiscard]] std::vector<results::StreamEvent> take_events() override { return std::exchange(events, {}); }
  std::string page() override { return {}; }
  void set_bias() noexcept override {}
  [[nodiscard]] results::SampleAccount account() const override { return {}; }
  [[nodiscard]] results::StreamHealth health() const override { return {}; }
  [[nodiscard]] std::string failure() const override { return {}; }

  netbox::Configuration configuration_;
};

/// 20 N, 60 N along Fz, 1 N m.
results::LoadCellScale mini40() {
  results::LoadCellScale scale;
  scale.range = {20, 20, 60, 1, 1, 1};
  return scale;
}

class Recording : public testing::Test {
 protected:
  Recording() : writer_(folder_.path() / "run.h5", {}, bench_.files()), recorder_(bench_, writer_, {2, -1}, mini40()) {}

  void sample(std::int32_t fz_counts, std::int64_t arrival_ns) {
    ++sequence_;
    bench_.records.push_back({{0, 0, fz_counts, 0, 0, 0}, sequence_, sequence_, 0, arrival_ns});
  }

  test::TemporaryFolder folder_;
  QueueBench bench_;
  results::RunWriter writer_;
  Recorder recorder_;
  std::uint32_t sequence_ = 0;
};

TEST_F(Recording, ShowsTheNewestOfEverythingWithItsAge) {
  sample(-2'500'000, 4'000'000);
  bench_.readings.push_back({results::MotorChannel::speed, 3'000'000, 0, -1234.5});
  bench_.readings.push_back({results::MotorChannel::supply_current, 3'500'000, 0, 7.5});
  bench_.readings.push_back({results::MotorChannel::coil_temperature, 3'600'000, 0, 61.0});
  recorder_.drain();
  const Observation seen = recorder_.observe(Instant(10'000'000));
  EXPECT_DOUBLE_EQ(seen.thrust.value(), 2.5) << "the axis points the other way";
  EXPECT_DOUBLE_EQ(seen.speed.value(), 1234.5) << "unsigned";
  EXPECT_DOUBLE_EQ(seen.supply_current.value(), 7.5);
  EXPECT_DOUBLE_EQ(seen.coil_temperature.value(), 61.0);
  EXPECT_EQ(seen.load_cell_age, Duration(6'000'000));
  EXPECT_EQ(seen.motor_age, Duration(6'400'000));
}

TEST_F(Recording, TakesTheMeanOfThePhaseAsZero) {
  recorder_.mark(results::Phase::zero_before, -1, RadPerSec(0));
  recorder_.drain();
  sample(-100'000, 1);
  sample(-300'000, 2);
  recorder_.drain();
  recorder_.take_zero();
  sample(-1'200'000, 3);
  recorder_.drain();
  EXPECT_DOUBLE_EQ(recorder_.observe(Instant(4)).thrust.value(), 1.0);
}

TEST_F(Recording, KeepsTheAgeGrowingWhenNothingComes) {
  recorder_.drain();
  EXPECT_EQ(recorder_.observe(Instant(std::chrono::seconds(3))).load_cell_age, std::chrono::seconds(3));
}

TEST_F(Recording, WritesAllThatCameInTheOrderItCame) {
  for (int i = 0; i < 20'000; ++i) sample(i, i);
  recorder_.drain();
  EXPECT_TRUE(bench_.records.empty());
  EXPECT_EQ(writer_.samples(), 20'000u);
}

TEST_F(Recording, WarnsOnceNearARangeAndOnceBeyondIt) {
  for (const std::int32_t counts : {47'000'000, 49'000'000, -50'000'000, 60'000'000, -61'000'000, 65'999'999}) {
    sample(counts, 1'500'000'000);
  }
  recorder_.drain();
  const auto events = recorder_.take_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, results::EventKind::near_range);
  EXPECT_EQ(events[0].text, "1.500 s: Fz carries 82 % of its range of 60 N");
  EXPECT_EQ(events[1].kind, results::EventKind::beyond_range);
  EXPECT_EQ(recorder_.range_trip(), std::nullopt);
  EXPECT_TRUE(recorder_.take_events().empty()) << "told once";
}

TEST_F(Recording, TripsAboveATenthBeyondARangeAndNamesTheAxis) {
  bench_.records.push_back({{0, 0, 0, 0, -1'150'000, 0}, 1, 1, 0, 2'000'000'000});
  recorder_.drain();
  EXPECT_EQ(recorder_.range_trip(), "Ty carries 115 % of its range of 1 N m");
  EXPECT_EQ(recorder_.take_events().at(0).kind, results::EventKind::range_trip);
}

TEST_F(Recording, WritesWhatHappenedToTheStreamAndTellsTheRunner) {
  bench_.events.push_back({results::EventKind::restarted, 5, 0, "the stream began anew"});
  recorder_.drain();
  EXPECT_EQ(recorder_.take_events().at(0).text, "the stream began anew");
  writer_.sync();
  EXPECT_EQ(results::read_run(writer_.path()).events.at(0).kind, results::EventKind::restarted);
}

TEST_F(Recording, MeasuresAPhaseThatBelongsToABias) {
  recorder_.mark(results::Phase::bias_before, -1, RadPerSec(0));
  recorder_.drain();
  sample(1'000'000, 1);
  sample(3'000'000, 2);
  recorder_.drain();
  EXPECT_EQ(recorder_.measured().records, 2u);
  EXPECT_DOUBLE_EQ(recorder_.measured().mean[2], 2.0);
  EXPECT_NEAR(recorder_.measured().standard_deviation[2], std::sqrt(2.0), 1e-12);
  recorder_.mark(results::Phase::bias_after, -1, RadPerSec(0));
  recorder_.drain();
  sample(500'000, 3);
  recorder_.drain();
  EXPECT_DOUBLE_EQ(recorder_.measured().mean[2], 0.5) << "each phase by itself";
}

/// Breaks when told.
class BreakableDisk final : public results::FileLayer {
 public:
  void sync_data(int descriptor) override {
    if (broken) throw std::system_error(EIO, std::generic_category());
    FileLayer::sync_data(descriptor);
  }
  bool broken = false;
};

TEST(RecordingOntoABrokenDisk, KeepsTheFirstErrorForTheRunnerAndThrowsNothingItself) {
  BreakableDisk disk;
  test::TemporaryFolder folder;
  QueueBench bench;
  results::RunWriter writer(folder.path() / "run.h5", {}, disk);
  Recorder recorder(bench, writer, {}, mini40());
  EXPECT_NO_THROW(recorder.check_failure());
  disk.broken = true;
  bench.time.set(std::chrono::seconds(1));
  recorder.drain();
  EXPECT_THROW(recorder.check_failure(), results::RecordError);
  recorder.drain();
  EXPECT_THROW(recorder.check_failure(), results::RecordError) << "it stays";
}

}  // namespace
}  // namespace kphi::daq
