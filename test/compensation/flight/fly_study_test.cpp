// The claims, over 400 draws, with the coefficients of the paper's whole campaign on the simulated bench.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "test/compensation/flight/bench_coefficients.hpp"
#include "test/source_dir.hpp"

namespace kphi::test {
namespace fly_study_test {

const std::string kProfiles = kphi::test::source_dir() + "/profiles/";

TEST(FlyStudy, OfFourHundredDrawsFindsWhatThePaperFound) {
  const TemporaryFolder folder;
  const std::string coefficients =
      bench_coefficients(kProfiles + "icra2021_5in_3blade.yaml", kProfiles + "bench_deterministic.yaml", folder);
  Process fly({test::kphi(), "fly", "--coefficients", coefficients, "--vehicle", kProfiles + "foldable_drone.yaml",
               "--draws", "400", "--seed", "1", "--json"});
  ASSERT_EQ(fly.wait(std::chrono::seconds(600)), 0) << fly.err();
  const auto study = nlohmann::json::parse(fly.out())["study"];
  RecordProperty("study", study.dump());
  EXPECT_EQ(study["draws"], 400);
  EXPECT_LE(study["hover_z_ratio"]["p50"].get<double>(), 0.4) << study;
  EXPECT_LE(study["forward_ratio"]["p50"].get<double>(), 0.65) << study;
  EXPECT_GE(study["hover_z_better"].get<double>(), 0.9) << study;
  EXPECT_GE(study["forward_better"].get<double>(), 0.9) << study;
  EXPECT_NEAR(study["square_speed_ratio"]["p10"].get<double>(), 1, 0.02) << study;
  EXPECT_NEAR(study["square_speed_ratio"]["p90"].get<double>(), 1, 0.02) << study;
  EXPECT_LE(study["lost_compensated"].get<int>(), 8) << study;
}

}  // namespace fly_study_test
}  // namespace kphi::test
