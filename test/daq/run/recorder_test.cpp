#include "daq/run/recorder.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "results/run_reader.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/queue_bench.hpp"

namespace kphi::daq {
namespace recorder_test {

class Recording : public testing::Test {
 protected:
  Recording() : writer_(folder_.path() / "run.h5", {}, bench_.files()), recorder_(bench_, guard_, writer_) {}

  void drain() {
    (void)guard_.relay();
    recorder_.drain();
  }

  void mark(results::Phase phase) { recorder_.mark({phase, -1, bench_.time.now().count(), 0}); }

  void sample(std::int32_t fz_counts, std::int64_t arrival_ns) {
    ++sequence_;
    bench_.records.push_back({{0, 0, fz_counts, 0, 0, 0}, sequence_, sequence_, 0, arrival_ns});
  }

  test::TemporaryFolder folder_;
  QueueBench bench_;
  Guard guard_{bench_, {}, mini40(), {}};
  results::RunWriter writer_;
  Recorder recorder_;
  std::uint32_t sequence_ = 0;
};

TEST_F(Recording, WritesAllThatCameInTheOrderItCame) {
  for (int i = 0; i < 20'000; ++i) sample(i, i);
  drain();
  EXPECT_TRUE(bench_.records.empty());
  EXPECT_EQ(writer_.samples(), 20'000u);
  writer_.sync();
  const auto written = results::read_run(writer_.path()).load_cell;
  ASSERT_EQ(written.size(), 20'000u);
  for (int i = 0; i < 20'000; ++i) ASSERT_EQ(written[static_cast<std::size_t>(i)].counts[2], i);
}

TEST_F(Recording, WarnsOnceNearARangeAndOnceBeyondIt) {
  for (const std::int32_t counts : {47'000'000, 49'000'000, -50'000'000, 60'000'000, -61'000'000, 65'999'999}) {
    sample(counts, 1'500'000'000);
  }
  drain();
  const auto events = recorder_.take_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, EventKind::near_range);
  EXPECT_EQ(events[0].text, "1.500 s: Fz carries 82 % of its range of 60 N");
  EXPECT_EQ(events[1].kind, EventKind::beyond_range);
  EXPECT_TRUE(recorder_.take_events().empty()) << "told once";
}

TEST_F(Recording, WritesWhatHappenedToTheStreamAndTellsTheRunner) {
  bench_.events.push_back({EventKind::restarted, 5, 0, "the stream began anew"});
  drain();
  EXPECT_EQ(recorder_.take_events().at(0).text, "the stream began anew");
  writer_.sync();
  EXPECT_EQ(results::read_run(writer_.path()).events.at(0).kind, EventKind::restarted);
}

TEST_F(Recording, MeasuresAPhaseThatBelongsToABias) {
  mark(results::Phase::bias_before);
  drain();
  sample(1'000'000, 1);
  sample(3'000'000, 2);
  drain();
  EXPECT_EQ(recorder_.measured().records, 2u);
  EXPECT_DOUBLE_EQ(recorder_.measured().mean[2], 2.0);
  EXPECT_NEAR(recorder_.measured().standard_deviation[2], std::sqrt(2.0), 1e-12);
  mark(results::Phase::bias_after);
  drain();
  sample(500'000, 3);
  drain();
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
  Guard guard(bench, {}, mini40(), {});
  Recorder recorder(bench, guard, writer);
  EXPECT_NO_THROW(recorder.check_failure());
  disk.broken = true;
  bench.time.set(std::chrono::seconds(1));
  recorder.drain();
  EXPECT_THROW(recorder.check_failure(), RecordError);
  recorder.drain();
  EXPECT_THROW(recorder.check_failure(), RecordError) << "it stays";
}

}  // namespace recorder_test
}  // namespace kphi::daq
