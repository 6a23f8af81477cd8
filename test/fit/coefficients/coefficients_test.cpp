#include "fit/coefficients/coefficients.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <fstream>
#include <set>

#include "base/error.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "fit/coefficients/error_in_flight.hpp"
#include "fit/uncertainty/analysis.hpp"
#include "profiles/vehicle.hpp"
#include "test/fit/bench_study.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace coefficients_test {

using ::testing::HasSubstr;
using ::testing::Not;

Provenance provenance() {
  Provenance result;
  result.measured_utc = "2021-05-30T00:00:00Z";
  result.tool_version = "0.1.0";
  result.campaign = "icra2021";
  result.propeller_name = "HQProp \"5x4\" \\ three\nblades";
  result.runs = {{"runs/5x3_phi000_rep1.h5", std::string(64, 'a'), "complete", std::nullopt}};
  result.supply_v = 12;
  return result;
}

std::string file_of(const std::vector<results::StepMean>& steps, const Provenance& about) {
  return format_coefficients(analysed(identify(steps)), about);
}

TEST(Coefficients, RoundTripThroughYamlBitForBit) {
  const auto [fit, analysis] = analysed(identify(campaign_steps()));
  const YAML::Node file = YAML::Load(format_coefficients({fit, analysis}, provenance()));
  EXPECT_EQ(file["overlap"].as<std::string>(), "rim_arc");
  EXPECT_EQ(file["propeller"]["id"].as<std::string>(), "5x3");
  EXPECT_EQ(file["propeller"]["name"].as<std::string>(), provenance().propeller_name);
  EXPECT_EQ(file["propeller"]["blades"].as<int>(), 3);
  EXPECT_EQ(file["K_T"]["u"].as<double>(), analysis.coefficients[0].combined());
  EXPECT_EQ(file["K_T"]["expanded_95"].as<double>(), analysis.coefficients[0].expanded());
  EXPECT_EQ(file["curve"]["slope_per_deg"]["expanded_95"].as<double>(), analysis.parameters[1].expanded());
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      EXPECT_EQ(file["uncertainty"]["covariance"][i][j].as<double>(), analysis.covariance[i][j]);
  EXPECT_EQ(file["curve"]["points_deg"].as<std::vector<double>>(), (std::vector<double>{45, 90, 180, 270}));
  ASSERT_EQ(file["table"].size(), 5u);
  EXPECT_EQ(file["table"][4]["k"].as<double>(), fit.table[4].k);
  EXPECT_EQ(file["table"][4]["expanded_95"].as<double>(), analysis.coefficients[4].expanded());
  EXPECT_EQ(file["table"][4]["k_at_speed"].as<double>(), fit.table[4].at_speed->k);
  EXPECT_EQ(file["table"][4]["repetitions"].as<int>(), 3);
  EXPECT_NEAR(file["valid"]["speed_rpm"][1].as<double>(), 19100, 1e-9);
  EXPECT_EQ(file["air_density_kg_m3"].as<std::string>(), "unknown");
  EXPECT_EQ(file["supply_v"].as<double>(), 12);
  EXPECT_EQ(file["provenance"]["runs"][0]["sha256"].as<std::string>(), std::string(64, 'a'));
}

TEST(Coefficients, AreReadByTheLibraryThatFlies) {
  for (std::size_t i = 0; i < 2 * std::size(kCurveForms); ++i) {
    const CurveForm form = kCurveForms[i / 2];
    const bool anchored = i % 2 == 1;
    const Identification fit = identify(campaign_steps(), {.curve = {.form = form, .anchored = anchored}});
    const auto file =
        compensation::parse_coefficients(format_coefficients(analysed(fit), provenance()), "coefficients.yaml");
    EXPECT_EQ(file.anchored, fit.curve_fit.anchored);
    EXPECT_EQ(file.curve.thrust_coefficient().value(), fit.curve_fit.K_T);
    EXPECT_EQ(file.form, name_of(form));
    ASSERT_EQ(file.parameters.size(), fit.curve_fit.parameters.size());
    for (const auto& [key, value, uncertainty] : file.parameters) EXPECT_EQ(value, fit.curve_fit.value(key)) << key;
    EXPECT_NEAR(to_degrees(file.curve.largest_fitted()), 270, 1e-9);
    ASSERT_TRUE(file.curve.has_uncertainty());
    EXPECT_EQ(file.table.size(), 5u);
    EXPECT_EQ(file.provenance.runs.size(), 1u);
    EXPECT_EQ(file.curve.at(from_degrees(100)), fit.curve().at(from_degrees(100)));
  }
}

TEST(Coefficients, OfABareTableAreReadToo) {
  const std::vector<CurvePoint> points{{0, 1.55e-6, 0}, {45, 1.4e-6, 0}, {270, 0.4e-6, 0}};
  const Identification fit = identify_table(points, {.propeller = "5e3"});
  const std::string text = format_coefficients(analysed(fit), {});
  const auto file = compensation::parse_coefficients(text, "k.yaml");
  EXPECT_FALSE(file.fastest_speed) << "a range nobody gave is not invented";
  EXPECT_EQ(file.propeller.id, "5e3");
  EXPECT_EQ(file.table.size(), 3u);
  EXPECT_FALSE(file.table[0].uncertainty);
  EXPECT_EQ(file.curve.at(from_degrees(100)), fit.curve().at(from_degrees(100)));
}

TEST(Coefficients, AreTheSameBytesForTheSameSteps) {
  EXPECT_EQ(file_of(campaign_steps(), provenance()), file_of(campaign_steps(), provenance()));
  EXPECT_NE(file_of(campaign_steps({}, 1), provenance()), file_of(campaign_steps({}, 2), provenance()));
}

TEST(Coefficients, PrintTheOtherUnitBesideThemAndNoNumberThatReadsAsText) {
  const std::string text = file_of(campaign_steps(), provenance());
  EXPECT_THAT(text, HasSubstr("N/RPM^2"));
  EXPECT_THAT(text, Not(HasSubstr(": nan")));
  EXPECT_THAT(text, HasSubstr("points_deg: [45.0, 90.0, 180.0, 270.0]"));
}

/// Paths as in the README.
void collect_keys(const YAML::Node& node, const std::string& path, std::set<std::string>& keys) {
  const bool of_maps = node.IsSequence() && node.size() > 0 && node[0].IsMap();
  if (of_maps) {
    for (const YAML::Node& entry : node) collect_keys(entry, path + "[]", keys);
  } else if (node.IsMap() && path != "provenance.fit.u") {
    for (const auto& entry : node)
      collect_keys(entry.second, (path.empty() ? "" : path + ".") + entry.first.as<std::string>(), keys);
  } else {
    keys.insert(path);
  }
}

std::set<std::string> keys_in_readme() {
  std::ifstream page(test::source_dir() + "/fit/coefficients/README.md");
  std::set<std::string> keys;
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("| `")) continue;
    const std::string key = line.substr(3, line.find('`', 3) - 3);
    const std::size_t brace = key.find('{');  // a.{b, c}: a.b and a.c
    std::istringstream words(brace == key.npos ? " " + key : key.substr(brace + 1));
    for (std::string word; words >> word;)
      keys.insert(key.substr(0, brace == key.npos ? 0 : brace) + word.substr(0, word.find_first_of(",}")));
  }
  return keys;
}

TEST(Coefficients, HaveExactlyTheKeysOfTheReadme) {
  auto steps = study_campaign({.rise = 0.15}, 4).steps;
  for (results::StepMean& step : steps) {
    step.torque_nm = 0.013 * step.thrust_n;
    step.air_density_kg_m3 = 1.2;
    step.air_density_u_kg_m3 = 0.01;
  }
  Provenance all = provenance();
  all.clock = MotorClock{1.0001, 1e-5};
  all.bench.emplace().motor_clock = 1e-5;
  all.cell_weighed = "weighed with 0.5 kg on 2021-05-30: reads right within 0.1 % along z";
  all.flight = "PX4 ULog, 93 s of a drone with 0.6 kg";
  all.throttle = {{"px4", 0.05, {{"THR_MDL_FAC", 0.4, 0.02}}, {"ardupilot"}}};
  std::set<std::string> written;
  for (const CurveForm form : kCurveForms) {
    const Identification fit =
        identify(steps, {.left_out = {{90, 2, "plate slipped"}}, .mounted_once = true, .curve = {.form = form}});
    collect_keys(YAML::Load(format_coefficients(analysed(fit), all)), "", written);
  }
  EXPECT_EQ(written, keys_in_readme());
}

/// With arms that turn this far, and these speeds.
profiles::Vehicle vehicle(double arm_to_deg, double from_rpm_, double to_rpm_) {
  profiles::Vehicle drone = profiles::load_vehicle(test::source_dir() + "/profiles/foldable_drone.yaml");
  drone.arm_angle_max = from_degrees(arm_to_deg);
  drone.arm_angle_min = from_degrees(0);
  drone.speed_min = from_rpm(from_rpm_);
  drone.speed_max = from_rpm(to_rpm_);
  return drone;
}

TEST(ErrorInFlight, IsThatOfTheVerdictForThePhiAndSpeedsOfTheVehicleAlone) {
  const auto fitted = analysed(identify(study_campaign({.rise = 0.15}, 4).steps));
  const auto file = compensation::parse_coefficients(format_coefficients(fitted, provenance()), "k.yaml");
  ASSERT_FALSE(file.thrust_error_within.rows.empty());
  EXPECT_NEAR(file.thrust_error_within.rows.back().shares.back(), *file.thrust_error.share_95, 1e-4)
      << "all that the fit claims";
  const auto of = [&](const profiles::Vehicle& drone) { return error_in_flight(file, drone).value(); };
  const ErrorInFlight whole = of(vehicle(180, 3000, 19100)), open = of(vehicle(90, 3000, 19100)),
                      hover = of(vehicle(90, 12000, 16000));
  EXPECT_NEAR(whole.phi_deg, 65, 1) << "as the vehicle file says";
  EXPECT_EQ(open.phi_deg, 0);
  EXPECT_LE(whole.share, *file.thrust_error.share_95 + 1e-4);
  EXPECT_LT(open.share, whole.share);
  EXPECT_LT(hover.share, open.share) << "k of this propeller depends on the speed";
  EXPECT_THAT(words(hover, vehicle(90, 12000, 16000)),
              HasSubstr("% (95 %) where foldable_drone flies, φ up to 0°, 12000 to 16000 RPM"));
  EXPECT_THAT(words(of(vehicle(90, 0, 25000)), vehicle(90, 0, 25000)), HasSubstr("of its 0 to 25000 RPM what was"));
}

/// In the shapes and on the straight ways between them.
TEST(ErrorInFlight, IsThatOfTheWaysOfHubsThatTheVehicleTells) {
  const auto file = compensation::parse_coefficients(
      format_coefficients(analysed(identify(study_campaign({}, 4).steps)), provenance()), "k.yaml");
  profiles::Vehicle quad = profiles::load_vehicle(test::source_dir() + "/profiles/telescoping_quad.yaml");
  EXPECT_NEAR(error_in_flight(file, quad)->phi_deg, 39.67, 0.01) << "in O";
  for (auto& hub : quad.hubs.at("O")) hub = {-hub.x, hub.y};
  EXPECT_GT(error_in_flight(file, quad)->phi_deg, 60) << "half way the hubs are beside the middle of an edge";
}

TEST(ErrorInFlight, IsUnknownWhereNobodyMeasured) {
  auto steps = study_campaign({}, 4).steps;
  for (auto& step : steps) step.occlusion_deg /= 9;  // up to 30°
  auto file = compensation::parse_coefficients(format_coefficients(analysed(identify(steps)), provenance()), "k.yaml");
  const profiles::Vehicle drone = vehicle(180, 3000, 19100);
  const auto error = error_in_flight(file, drone);
  ASSERT_TRUE(error);
  EXPECT_TRUE(std::isnan(error->share));
  EXPECT_EQ(error->readiness, Readiness::not_yet);
  EXPECT_THAT(words(*error, drone), HasSubstr("reaches φ 65°, beyond the widest"));
  file.thrust_error_within = {};
  EXPECT_FALSE(error_in_flight(file, drone)) << "an older file does not tell";
}

TEST(ErrorInFlight, IsNoBetterThanTheDoubtsOfTheFile) {
  auto steps = study_campaign(without_kink(), 4).steps;
  const auto verdict = [&] {
    const auto file =
        compensation::parse_coefficients(format_coefficients(analysed(identify(steps)), provenance()), "k.yaml");
    return error_in_flight(file, vehicle(90, 9000, 16000))->readiness;
  };
  EXPECT_EQ(verdict(), Readiness::fit_to_fly);
  for (auto& step : steps) step.torque_nm *= 0.1;
  EXPECT_EQ(verdict(), Readiness::not_yet) << "no propeller makes this thrust of that power";
}

class RecordedFitTest : public ::testing::Test {
 protected:
  RecordedFit written(const Identification& found, const std::optional<BenchUncertainty>& bench) {
    Provenance provenance;
    provenance.bench = bench;
    write(format_coefficients(analysed(found), provenance));
    return read_recorded_fit(file_);
  }
  void write(const std::string& text) { std::ofstream(file_) << text; }

  test::TemporaryFolder folder_;
  std::string file_ = (folder_ / "coefficients.yaml").string();
};

TEST_F(RecordedFitTest, FitsAndBudgetsTheSameAgain) {
  IdentificationOptions options;
  options.loss = Loss::tukey;
  options.weighting = Weighting::effective_variance;
  options.estimator = Estimator::with_offset;
  options.curve.anchored = true;
  options.curve.points_deg = {45, 180, 270};
  options.curve.loss = Loss::cauchy;
  options.speed_range.max_rad_s = from_rpm(17000).value();
  options.left_out = {{90, 2, "plate \"slipped\": seen"}};
  auto steps = study_campaign({}, 4).steps;
  for (auto& step : steps) step.speed_sd_rad_s = 1;
  options.overlap = compensation::OverlapMeasure::area_share;
  const Identification found = identify(steps, options);
  AnalysisOptions how;
  how.bench.cell_calibration = 0.0031;
  how.bench.alignment_rad = 0.011;
  how.bench.motor_clock = 1.7e-5;

  const RecordedFit record = written(found, how.bench);
  const Identification again = identify(steps, record.options);
  EXPECT_EQ(again.curve_fit.value("intercept"), found.curve_fit.value("intercept"));
  EXPECT_EQ(again.curve_fit.value("slope_per_deg"), found.curve_fit.value("slope_per_deg"));
  EXPECT_EQ(again.options.overlap, found.options.overlap);
  EXPECT_EQ(again.selection.used.size(), found.selection.used.size());
  ASSERT_EQ(again.options.left_out.size(), 1u);
  EXPECT_EQ(again.options.left_out[0].cause, "plate \"slipped\": seen");
  AnalysisOptions as_recorded;
  as_recorded.bench = record.bench.value();
  EXPECT_FALSE(as_recorded.bench.cross_axis) << "what nobody knew stays unknown";
  const Analysis before = analyse(found, how), after = analyse(again, as_recorded);
  for (std::size_t i = 0; i < before.coefficients.size(); ++i)
    EXPECT_NEAR(after.coefficients[i].combined() / before.coefficients[i].combined(), 1, 1e-12);
}

TEST_F(RecordedFitTest, KeepsThePropellerThatSomebodyNamed) {
  const Identification found = identify(campaign_steps(), {.propeller = "mine", .diameter_in = 5.1, .blades = 4});
  const Identification again = identify(campaign_steps(), written(found, std::nullopt).options);
  EXPECT_EQ(again.propeller, "mine");
  EXPECT_EQ(again.diameter_in, 5.1);
  EXPECT_EQ(again.blades, 4);
}

TEST_F(RecordedFitTest, OfAnOlderFileIsThePlainFitAndNoUncertainty) {
  const std::string text = file_of(campaign_steps(), {});
  const std::size_t begin = text.find(", k_by:"), end = text.find(", speed_range_rpm");
  ASSERT_NE(begin, std::string::npos);
  write(text.substr(0, begin) + text.substr(end));
  const RecordedFit record = read_recorded_fit(file_);
  EXPECT_EQ(record.options.loss, Loss::none);
  EXPECT_FALSE(record.bench);
  EXPECT_GT(record.options.speed_range.min_rad_s, 300);
}

TEST_F(RecordedFitTest, RefusesWordsItDoesNotKnow) {
  std::string text = file_of(campaign_steps(), {});
  text.replace(text.find("loss: none"), 10, "loss: soft");
  write(text);
  EXPECT_THROW((void)read_recorded_fit(file_), ConfigurationError);
  write("nonsense: true\n");
  EXPECT_THROW((void)read_recorded_fit(file_), compensation::CoefficientError);
}

}  // namespace coefficients_test
}  // namespace kphi::fit
