// docs/science.md says enough: who has it and numpy finds the same numbers (rebuild.py).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "results/steps_csv.hpp"
#include "test/fit/bench_study.hpp"
#include "test/fit/export/outside_reader.hpp"
#include "test/fit/zero_study.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace rebuild_test {

std::vector<std::vector<results::StepMean>> campaigns() {
  std::vector<std::vector<results::StepMean>> all;
  const auto& stands = scattering_stands();
  for (unsigned seed = 1; seed <= 50; ++seed) {
    StudyTruth truth;
    truth.bend = seed % 3 == 0 ? 0.03 : 0;
    truth.rise = seed % 4 == 0 ? 0.1 : 0;
    all.push_back(study_campaign(truth, seed).steps);
    all.push_back(scattering_campaign(stands[seed % stands.size()], seed));
  }
  return all;
}

TEST(ScienceByNumpy, FindsTheSameCoefficientUncertaintyAndVerdict) {
  if (!test::works("/usr/bin/python3 -c 'import numpy, scipy'"))
    GTEST_SKIP() << "python3-numpy or python3-scipy is not installed";
  const test::TemporaryFolder folder;
  std::string command = "/usr/bin/python3 " + test::source_dir() + "/test/fit/science/rebuild.py";
  struct Numbers {
    double K_T, u, number;
  };
  std::vector<Numbers> expected;
  for (const auto& steps : campaigns()) {
    const auto file = folder.path() / fmt::format("steps_{:03}.csv", expected.size());
    test::write_file(file, results::format_steps(steps));
    command += " " + file.string();
    const Fitted fitted = analysed(identify(steps));
    const Budget& K_T = fitted.analysis.coefficients.front();
    expected.push_back({K_T.value, K_T.combined(), fitted.analysis.flight.error.share});
  }
  const test::Reading said = test::read_with(command);
  ASSERT_EQ(said.status, 0) << said.out;
  std::istringstream lines(said.out);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    Numbers found{};
    ASSERT_TRUE(lines >> found.K_T >> found.u >> found.number) << said.out;
    EXPECT_NEAR(found.K_T / expected[i].K_T, 1, 1e-9) << i;
    EXPECT_NEAR(found.u / expected[i].u, 1, 1e-9) << i;
    EXPECT_NEAR(found.number / expected[i].number, 1, 1e-9) << i;
  }
}

TEST(ScienceByNumpy, FindsTheExpectationAndTheScatterThatTheEquationsSay) {
  if (!test::works("/usr/bin/python3 -c 'import numpy, scipy'"))
    GTEST_SKIP() << "python3-numpy or python3-scipy is not installed";
  const test::Reading said =
      test::read_with("/usr/bin/python3 " + test::source_dir() + "/test/fit/science/simulate.py");
  EXPECT_EQ(said.status, 0) << said.out;
  EXPECT_GE(std::ranges::count(said.out, '\n'), 20) << said.out;
}

}  // namespace rebuild_test
}  // namespace kphi::fit
