#include "fit/coefficients/recorded_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "base/error.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/uncertainty/analysis.hpp"
#include "test/fit/bench_study.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace {

using ::testing::HasSubstr;

class RecordedFitTest : public ::testing::Test {
 protected:
  RecordedFit written(const Identification& found, const std::optional<BenchUncertainty>& bench) {
    Provenance provenance;
    provenance.bench = bench;
    write(format_coefficients(found, provenance));
    return read_recorded_fit(file_);
  }
  void write(const std::string& text) { std::ofstream(file_) << text; }

  test::TemporaryFolder folder_;
  std::string file_ = (folder_ / "coefficients.yaml").string();
};

TEST_F(RecordedFitTest, FitsAndBudgetsTheSameAgain) {
  const StudyCampaign campaign = study_campaign({}, 4);
  IdentificationOptions options;
  options.loss = Loss::tukey;
  options.weighting = Weighting::effective_variance;
  options.estimator = Estimator::with_offset;
  options.line.anchored = true;
  options.line.points_deg = {45, 180};
  options.speed_range.max_rad_s = from_rpm(17000).value();
  options.left_out = {{90, 2, "plate \"slipped\": seen"}};
  auto steps = campaign.steps;
  for (auto& step : steps) step.speed_sd_rad_s = 1;
  Identification found = identify(steps, options);
  found.overlap = compensation::OverlapMeasure::area_share;
  AnalysisOptions how;
  how.bench.cell_calibration = 0.0031;
  how.bench.alignment_rad = 0.011;
  how.bench.motor_clock = 1.7e-5;

  const RecordedFit record = written(found, how.bench);
  const Identification again = identify_again(steps, record);
  EXPECT_EQ(again.line.intercept, found.line.intercept);
  EXPECT_EQ(again.line.slope_per_deg, found.line.slope_per_deg);
  EXPECT_EQ(again.overlap, found.overlap);
  EXPECT_EQ(again.selection.used.size(), found.selection.used.size());
  ASSERT_EQ(again.left_out.size(), 1u);
  EXPECT_EQ(again.left_out[0].cause, "plate \"slipped\": seen");
  AnalysisOptions as_recorded;
  as_recorded.bench = record.bench.value();
  EXPECT_FALSE(as_recorded.bench.cross_axis) << "what nobody knew stays unknown";
  const Analysis before = analyse(found, how), after = analyse(again, as_recorded);
  for (std::size_t i = 0; i < before.coefficients.size(); ++i)
    EXPECT_NEAR(after.coefficients[i].combined() / before.coefficients[i].combined(), 1, 1e-12);
}

TEST_F(RecordedFitTest, KeepsThePropellerThatSomebodyNamed) {
  Identification found = identify(campaign_steps());
  found.propeller = "mine";
  found.diameter_in = 5.1;
  found.blades = 4;
  const Identification again = identify_again(campaign_steps(), written(found, std::nullopt));
  EXPECT_EQ(again.propeller, "mine");
  EXPECT_EQ(again.diameter_in, 5.1);
  EXPECT_EQ(again.blades, 4);
}

TEST_F(RecordedFitTest, OfAnOlderFileIsThePlainFitAndNoUncertainty) {
  const std::string text = format_coefficients(identify(campaign_steps()), {});
  const std::size_t begin = text.find(", k_by:"), end = text.find(", speed_range_rpm");
  ASSERT_NE(begin, std::string::npos);
  write(text.substr(0, begin) + text.substr(end));
  const RecordedFit record = read_recorded_fit(file_);
  EXPECT_EQ(record.options.loss, Loss::none);
  EXPECT_FALSE(record.bench);
  EXPECT_GT(record.options.speed_range.min_rad_s, 300);
}

TEST_F(RecordedFitTest, RefusesWordsItDoesNotKnow) {
  std::string text = format_coefficients(identify(campaign_steps()), {});
  text.replace(text.find("loss: none"), 10, "loss: soft");
  write(text);
  EXPECT_THROW((void)read_recorded_fit(file_), ConfigurationError);
  write("nonsense: true\n");
  EXPECT_THROW((void)read_recorded_fit(file_), compensation::CoefficientError);
}

}  // namespace
}  // namespace kphi::fit
