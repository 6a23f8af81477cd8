// Logs of real stands, as if they had been recorded here. Skipped where KPHI_TEST_DATA does not say where they are.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "results/reduction/bin_statistics.hpp"
#include "results/reduction/motor_series.hpp"
#include "results/reduction/reduction.hpp"
#include "results/steps_csv.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::real_logs_test {

constexpr double kRpm = M_PI / 30;

struct Row {
  double time_s = 0, esc_us = 0, thrust_n = 0, speed_rpm = 0;
};

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::stringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  return fields;
}

class RealLogs : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("KPHI_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "KPHI_TEST_DATA is not set";
    folder_ = std::filesystem::path(data) / "real/rcb1780-timeseries";
    if (!std::filesystem::exists(folder_)) GTEST_SKIP() << folder_ << " is not there";
  }

  /// Columns by name; rows with other than the header's number of fields hold unquoted commas and are passed over.
  [[nodiscard]] std::vector<Row> rows(const std::string& name) const {
    std::ifstream file(folder_ / (name + ".csv"));
    std::string line;
    std::getline(file, line);
    const auto header = fields_of(line);
    const auto column = [&](const char* word) {
      const auto at = std::find_if(header.begin(), header.end(), [&](const auto& h) { return h.find(word) != h.npos; });
      return static_cast<std::size_t>(at - header.begin());
    };
    const std::size_t time = column("Time"), esc = column("ESC"), thrust = column("Thrust"),
                      speed = column("Motor Optical Speed");
    std::vector<Row> rows;
    while (std::getline(file, line)) {
      const auto fields = fields_of(line);
      if (fields.size() <= speed || fields.size() > header.size()) continue;
      rows.push_back({std::atof(fields[time].c_str()), std::atof(fields[esc].c_str()),
                      std::atof(fields[thrust].c_str()), std::atof(fields[speed].c_str())});
    }
    return rows;
  }

  std::filesystem::path folder_;
};

constexpr double kRate = 26;

Nanoseconds at_row(std::size_t row) { return static_cast<Nanoseconds>(1e9 * static_cast<double>(row) / kRate); }

/// A load cell that counts micronewtons 26 times a second, row after row.
RunRecording recording(const std::vector<Row>& rows) {
  RunRecording run;
  run.outcome = Outcome::complete;
  run.header.minimum_discard_s = 0.5;
  run.header.load_cell.sample_rate_hz = kRate;
  run.header.load_cell.device_rate_hz = kRate;
  std::int32_t torque = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto time = at_row(i);
    LoadCellRecord record;
    const bool frozen = i > 0 && rows[i].thrust_n == rows[i - 1].thrust_n;
    if (!frozen) torque = static_cast<std::int32_t>(i);  // there is no torque channel: another count with every thrust
    record.counts = {0, 0, static_cast<std::int32_t>(std::lround(1e6 * rows[i].thrust_n)), 0, 0, torque};
    record.rdt_sequence = record.ft_sequence = static_cast<std::uint32_t>(i + 1);
    record.arrival_ns = time;
    run.load_cell.push_back(record);
    run.motor.push_back({MotorChannel::speed, time, 0, kRpm * rows[i].speed_rpm});
  }
  return run;
}

TEST_F(RealLogs, TheZeroOfTheRampIsRecognised) {
  const auto log = rows("Polar_2021-06-18_140528");
  const auto stands = [](const Row& row) { return row.esc_us <= 1000.5 && row.speed_rpm == 0; };
  const auto first = std::find_if_not(log.begin(), log.end(), stands);
  const auto last = std::find_if_not(log.rbegin(), log.rend(), stands).base();
  ASSERT_GT(first - log.begin(), 100);

  RunRecording run = recording(log);
  const auto begin = static_cast<std::size_t>(first - log.begin());
  const auto end = static_cast<std::size_t>(last - log.begin());
  run.phases.push_back({Phase::zero_before, -1, 0, 0});
  constexpr std::size_t kPiece = 20;  // of the ramp, as a step
  int number = 0;
  for (std::size_t at = begin; at + kPiece < end; at += kPiece) {
    double speed = 0;
    for (std::size_t i = at; i < at + kPiece; ++i) speed += kRpm * log[i].speed_rpm / kPiece;
    run.phases.push_back({Phase::step, number++, at_row(at), speed});
  }
  run.phases.push_back({Phase::zero_after, -1, at_row(end), 0});
  run.phases.push_back({Phase::end, -1, at_row(log.size()), 0});

  const Reduced reduced = reduce_with_zeros(run);
  double tx = 0, raw = 0, xx = 0;
  for (const auto& step : reduced.steps) {
    if (std::isnan(step.thrust_n) || step.speed_rad_s < kRpm * 1000) continue;
    const double x = step.speed_rad_s * step.speed_rad_s;
    tx += step.thrust_n * x;
    raw += (step.thrust_n + step.zero_n) * x;
    xx += x * x;
  }
  ASSERT_GT(reduced.steps.size(), 50u);
  EXPECT_NEAR(tx / xx, 2.63e-4, 0.02e-4);
  EXPECT_NEAR(raw / xx, 2.45e-4, 0.02e-4) << "what it would be untared";
  EXPECT_NEAR(reduced.zero.moved_n, 0.085, 0.03);
  EXPECT_FALSE(reduced.zero.noisy());
}

/// Thrust of the rows near a speed, as it would be at that speed.
std::vector<double> thrust_at_constant_speed(const std::vector<Row>& rows, double rpm) {
  std::vector<double> values;
  for (const Row& row : rows) {
    if (std::abs(row.speed_rpm / rpm - 1) < 0.03) values.push_back(row.thrust_n * std::pow(rpm / row.speed_rpm, 2));
  }
  return values;
}

TEST_F(RealLogs, AThrustThatDecaysAtConstantSpeedDrifts) {
  for (const char* name : {"ConstVel_2021-06-17_084922", "Run_142_Constant_RPM_2021-11-19_163918"}) {
    const auto values = thrust_at_constant_speed(rows(name), 3500);
    ASSERT_GT(values.size(), 2000u);
    EXPECT_TRUE(drifts(values)) << name;
  }
}

TEST_F(RealLogs, ThePlateauOfTheRampDoesNotDrift) {
  const auto log = rows("Polar_2021-06-18_140528");
  const auto on_it = [](const Row& row) { return std::abs(row.speed_rpm / 5006 - 1) < 0.01; };
  std::vector<double> longest, thrust;
  for (const Row& row : log) {
    if (!on_it(row)) thrust.clear();
    if (on_it(row)) thrust.push_back((row.thrust_n + 4.06) * std::pow(5006 / row.speed_rpm, 2));
    if (thrust.size() > longest.size()) longest = thrust;
  }
  ASSERT_GT(longest.size(), 300u);
  EXPECT_FALSE(drifts(longest)) << longest.size() << " rows";
}

TEST_F(RealLogs, TheReductionSaysThatAStepOfTheDecayingLogDrifts) {
  const auto log = rows("ConstVel_2021-06-17_084922");
  std::vector<Row> kept;
  for (int i = 0; i < 60; ++i) kept.push_back({0, 1000, 0, 0});  // nobody took a zero
  for (const Row& row : log) {
    if (std::abs(row.speed_rpm / 3500 - 1) < 0.03) kept.push_back(row);
  }
  RunRecording run = recording(kept);
  run.phases = {{Phase::zero_before, -1, 0, 0},
                {Phase::step, 0, at_row(60), kRpm * 3500},
                {Phase::end, -1, at_row(kept.size()), 0}};
  const auto steps = reduce(run);
  ASSERT_EQ(steps.size(), 1u);
  EXPECT_TRUE(test::has(steps[0], QualityFlag::drifted)) << quality_flag_names(steps[0].quality_flags);
}

/// Steps of 100 rows, without zeros but for rows that are put in front.
std::vector<StepMean> steps_of(const std::vector<Row>& rows) {
  std::vector<Row> all(60, Row{0, 1000, 0, 0});
  all.insert(all.end(), rows.begin(), rows.end());
  RunRecording run = recording(all);
  run.phases.push_back({Phase::zero_before, -1, 0, 0});
  constexpr std::size_t kPiece = 100;
  for (std::size_t at = 60; at + kPiece <= all.size(); at += kPiece) {
    run.phases.push_back({Phase::step, static_cast<int>(at / kPiece), at_row(at), kRpm * 3500});
  }
  run.phases.push_back({Phase::end, -1, at_row(all.size()), 0});
  return reduce(run);
}

TEST_F(RealLogs, AFrozenChannelIsNamedAtItsStepsAndAtNoOther) {
  auto log = rows("ConstVel_2021-06-17_084922");
  log.resize(1500);
  EXPECT_TRUE(test::steps_flagged(steps_of(log), QualityFlag::frozen).empty()) << "it has no such rows of its own";
  for (std::size_t i = 400; i < 800; ++i) log[i].thrust_n = log[400].thrust_n;
  EXPECT_EQ(test::steps_flagged(steps_of(log), QualityFlag::frozen), (std::vector{4, 5, 6, 7}));
}

TEST_F(RealLogs, ImpossibleSpeedsAreNamedAtTheirSteps) {
  const auto log = rows("Run_142_Constant_RPM_2021-11-19_163918");
  std::uint64_t counted = 0;
  for (const auto& step : steps_of(log)) {
    counted += step.speed_glitches;
    EXPECT_EQ(test::has(step, QualityFlag::speed_glitch), step.speed_glitches > 0);
  }
  EXPECT_GT(counted, 0u);
}

TEST_F(RealLogs, ImpossibleSpeedsAreCounted) {
  const auto log = rows("Run_142_Constant_RPM_2021-11-19_163918");
  const RunRecording run = recording(log);
  const MotorSeries series(run.motor);
  const Window all{0, at_row(log.size())};
  std::size_t spikes = 0, left = 0;
  for (const Row& row : log) spikes += row.speed_rpm > 20'000;
  for (const auto& r : series.over(MotorChannel::speed, all)) left += r.value > kRpm * 20'000;
  EXPECT_GT(spikes, 0u);
  EXPECT_GT(series.glitches(all), 0u);
  EXPECT_LT(left, spikes) << "those that last longer than two readings stay";
}

}  // namespace kphi::results::real_logs_test
