#include "results/load_cell_columns.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "results/run_reader.hpp"
#include "results/run_writer.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results {
namespace {

using test::make_run;
using test::same;
using test::TemporaryFolder;
using test::Truth;
using test::write_pieces;
using test::write_run;
using ::testing::HasSubstr;

/// Of a run file, what its columns say against its records.
void expect_same_columns(const std::filesystem::path& path) {
  const RunRecording whole = read_run(path);
  const RunFile file = open_run(path);
  EXPECT_TRUE(file.run.load_cell.empty());
  EXPECT_EQ(file.run.phases.size(), whole.phases.size());
  EXPECT_EQ(file.run.motor.size(), whole.motor.size());
  ASSERT_EQ(file.load_cell->size(), whole.load_cell.size());
  const auto ft = file.load_cell->ft_sequence();
  std::vector<Nanoseconds> arrival(whole.load_cell.size());
  file.load_cell->read_arrival(0, arrival);
  for (const std::size_t n : {std::size_t{1}, std::size_t{3000}, whole.load_cell.size()}) {
    for (std::size_t first = 0; first + n <= whole.load_cell.size(); first += n + 777) {
      const LoadCellRows rows = file.load_cell->rows(first, first + n);
      for (std::size_t i = 0; i < n; ++i) {
        const LoadCellRecord& record = whole.load_cell[first + i];
        ASSERT_TRUE(
            same(record, {rows.counts[i], record.rdt_sequence, ft[first + i], rows.status[i], arrival[first + i]}))
            << first << " + " << i;
      }
    }
  }
}

TEST(LoadCellColumns, AreGivenWithoutTheRecords) {
  const TemporaryFolder folder;
  Truth truth;
  truth.rate_hz = 7000;
  write_run(folder / "a.h5", make_run(truth));
  expect_same_columns(folder / "a.h5");
}

TEST(LoadCellColumns, AreGivenOfAPart) {
  const TemporaryFolder folder;
  const RunRecording run = make_run({});
  {
    RunWriter writer(folder / "a.h5", run.header);
    write_pieces(writer, run);
  }
  expect_same_columns(folder / "a.h5.part");
}

TEST(LoadCellColumns, SayWhereTheFileEndsTooEarly) {
  const TemporaryFolder folder;
  const auto path = folder / "a.h5";
  Truth truth;
  truth.rate_hz = 7000;
  write_run(path, make_run(truth));
  const RunFile file = open_run(path);
  test::make_writable(path);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  try {
    (void)file.load_cell->rows(0, file.load_cell->size());
    FAIL() << "half of it is gone";
  } catch (const RecordError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a.h5: read counts: the file ends too early"));
  }
}

}  // namespace
}  // namespace kphi::results
