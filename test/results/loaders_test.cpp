// The loaders of the README, run as they stand there by the programs they are for.
#include <gmock/gmock.h>

#include <cmath>
#include <sstream>

#include "results/file_layer.hpp"
#include "results/steps_csv.hpp"
#include "test/fit/export/outside_reader.hpp"
#include "test/results/synthetic_run.hpp"
#include "test/source_dir.hpp"

namespace kphi::results::loaders_test {

using namespace test;
using namespace testing;
using kphi::test::read_with;
using kphi::test::works;

/// The block of code in this language that stands in the README.
std::string loader(const std::string& language) {
  const std::string readme = read_text(kphi::test::source_dir() + "/results/README.md");
  const std::string fence = "```" + language + "\n";
  const std::size_t begin = readme.find(fence) + fence.size();
  return readme.substr(begin, readme.find("```", begin) - begin);
}

class Loaders : public testing::Test {
 protected:
  Loaders() {
    std::filesystem::create_directories(folder / "runs");
    run.header.thrust_axis = 2;
    write_run(folder / "runs/5x3_phi090_rep2.h5", run);
    write_text(folder / "steps.csv", format_steps(reduce(run)));
  }
  /// The numbers that `program` prints, one in each line.
  std::vector<double> printed(const std::string& program, const std::string& file, const std::string& code) const {
    write_text(folder / file, code);
    const auto reading = read_with("cd " + folder.path().string() + " && " + program + " " + file);
    EXPECT_EQ(reading.status, 0) << reading.out;
    std::istringstream lines(reading.out);
    return {std::istream_iterator<double>(lines), {}};
  }
  void expect_the_run(const std::vector<double>& numbers) const {
    ASSERT_EQ(numbers.size(), 4u);
    const double force = run.load_cell.back().counts[2] / run.header.load_cell.counts_per_newton;
    EXPECT_NEAR(numbers[0], force, 1e-9 * std::abs(force));
    EXPECT_NEAR(numbers[1], 1e-9 * static_cast<double>(sample_times(run).back()), 1e-9);
    EXPECT_NEAR(numbers[2], reduce(run).back().thrust_n, 0.01);
    EXPECT_EQ(numbers[3], 3) << "steps, or the time between two bins in units of 10 ms";
  }
  const TemporaryFolder folder;
  RunRecording run = make_run({.records_per_datagram = 40});
};

TEST_F(Loaders, OfPythonOpenARun) {
  if (!works("/usr/bin/python3 -c 'import h5py, pandas, xarray, h5netcdf'"))
    GTEST_SKIP() << "no python3-h5py, python3-pandas, python3-xarray or python3-h5netcdf";
  expect_the_run(printed("/usr/bin/python3", "loader.py", loader("python") + R"(
end = steps["window_end_s"].iloc[-1]
print(repr(float(force[-1])))
print(repr(float(force_t[-1])))
print(repr(float(thrust[(time > steps["window_begin_s"].iloc[-1]) & (time < end)].mean())))
print(len(steps))
assert cell["counts"].dims == ("t_ns", "component"), cell
assert cell["counts"].attrs["units"] == "count"
assert (cell["t_ns"].values == (force_t * 1e9).round().astype("int64")).all()
)"));
}

TEST_F(Loaders, OfPythonFindAPlotWithUnitsFromTheRoot) {
  if (!works("/usr/bin/python3 -c 'import h5py'")) GTEST_SKIP() << "no python3-h5py";
  write_text(folder / "plot.py", R"(
import h5py
with h5py.File("runs/5x3_phi090_rep2.h5") as run:
    plot = run[run.attrs["default"]]
    signal, axes = plot[plot.attrs["signal"]], plot[plot.attrs["axes"]]
    print(plot.attrs["NX_class"], signal.attrs["units"], axes.attrs["units"], plot["speed"].attrs["units"])
    print(signal.shape == axes.shape, signal.dims[0][0].name)
)");
  const auto reading = read_with("cd " + folder.path().string() + " && /usr/bin/python3 plot.py");
  EXPECT_EQ(reading.out, "NXdata N s rad s-1\nTrue /plot/time\n");
}

TEST_F(Loaders, OfOctaveOpenARun) {
  if (!works("octave-cli --version")) GTEST_SKIP() << "no octave";
  expect_the_run(printed("octave-cli --norc --no-history", "loader.m", loader("octave") + R"(
printf("%.17g\n", force(end), force_t(end));
time = run.plot.time;
printf("%.17g\n", mean(thrust(time > 6.2 & time < 6.9)), 3);
)"));
}

}  // namespace kphi::results::loaders_test
