#include "compensation/file/coefficient_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "test/compensation/line_of.hpp"
#include "test/source_dir.hpp"

namespace kphi::compensation {
namespace coefficient_file_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kGood = R"(format: kphi-coefficients/2
measured_utc: "2021-05-30T00:00:00Z"
tool_version: "0.1.0"
propeller: {id: 5x3, name: "Dalprop 5040", diameter_in: 5.0, blades: 3}
k_unit: N/(rad/s)^2
overlap: rim_arc
K_T: {value: 1.55e-06, u: 1.0e-09, freedom: 12, expanded_95: 2.2e-09, phi_deg: 0.0}
curve:
  form: line
  anchored: false
  intercept: {value: 1.6e-06, u: 1.0e-09, freedom: .inf, expanded_95: 2.0e-09}
  slope_per_deg: {value: -4.5e-09, u: unknown}
  points_deg: [45.0, 90.0, 180.0, 270.0]
valid: {phi_deg: [0.0, 270.0], speed_rpm: [3000.0, 19100.0]}
table:
  - {phi_deg: 0.0, k: 1.55e-06, u: 1.0e-09, freedom: .inf, expanded_95: 2.0e-09, k_at_speed: 1.54e-06, at_speed_rpm: 19100.0, steps: 37, repetitions: 3}
  - {phi_deg: 45.0, k: 1.4e-06, u: 1.1e-09, freedom: .inf, expanded_95: 2.2e-09, k_at_speed: 1.39e-06, at_speed_rpm: 19100.0, steps: 37, repetitions: 3}
air_density_kg_m3: 1.2
supply_v: 12.0
provenance:
  campaign: icra2021_5in_3blade
  fit: {model: "T = k w^2", estimator: huber}
  runs: [{file: runs/5x3_phi000_rep1.h5, sha256: 00ff}]
uncertainty:
  covariance: [[1.0e-18, 0.0, 0.0], [0.0, 1.0e-18, -5.0e-21], [0.0, -5.0e-21, 4.0e-23]]
  not_known: [calibration, alignment]
)";

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string refusal_of(const std::string& text) {
  try {
    (void)parse_coefficients(text, "c.yaml");
  } catch (const CoefficientError& error) {
    EXPECT_THAT(error.what(), HasSubstr("; ")) << "the next move is missing";
    return error.what();
  }
  return "not refused";
}

TEST(CoefficientFile, GivesWhatTheFileSaysInSiUnits) {
  const Coefficients c = parse_coefficients(kGood, "c.yaml");
  EXPECT_EQ(c.path, "c.yaml");
  EXPECT_EQ(c.measured_utc, "2021-05-30T00:00:00Z");
  EXPECT_EQ(c.propeller.id, "5x3");
  EXPECT_EQ(c.propeller.diameter_in, 5.0);
  EXPECT_EQ(c.propeller.blades, 3);
  EXPECT_EQ(c.curve.overlap(), OverlapMeasure::rim_arc);
  EXPECT_EQ(c.curve.thrust_coefficient().value(), 1.55e-6);
  ASSERT_TRUE(c.thrust_coefficient);
  EXPECT_EQ(c.thrust_coefficient->u, 1e-9);
  EXPECT_EQ(c.thrust_coefficient->expanded_95, 2.2e-9);
  EXPECT_EQ(c.thrust_coefficient->freedom, 12);
  ASSERT_EQ(c.parameters.size(), 2u);
  EXPECT_EQ(c.parameters[0].key, "intercept");
  EXPECT_TRUE(std::isinf(c.parameters[0].uncertainty->freedom));
  EXPECT_EQ(c.parameters[1].value, -4.5e-9);
  EXPECT_FALSE(c.parameters[1].uncertainty);
  EXPECT_EQ(c.not_known, (std::vector<std::string>{"calibration", "alignment"}));
  EXPECT_FALSE(c.anchored);
  EXPECT_EQ(line_of(c.curve).intercept.value(), 1.6e-6);
  EXPECT_DOUBLE_EQ(line_of(c.curve).slope_per_rad, -4.5e-9 * 180 / kPi);
  EXPECT_NEAR(c.curve.at(from_degrees(100)).value(), 1.6e-6 - 4.5e-7, 1e-18);
  EXPECT_EQ(c.form, "line");
  ASSERT_EQ(c.points.size(), 4u);
  EXPECT_EQ(c.points[3], from_degrees(270));
  EXPECT_EQ(c.curve.largest_fitted(), from_degrees(270));
  EXPECT_EQ(c.fastest_speed, from_rpm(19100));
  ASSERT_EQ(c.table.size(), 2u);
  EXPECT_EQ(c.table[1].k.value(), 1.4e-6);
  EXPECT_EQ(c.table[1].at_speed, from_rpm(19100));
  EXPECT_EQ(c.air_density_kg_m3, 1.2);
  EXPECT_EQ(c.provenance.campaign, "icra2021_5in_3blade");
  ASSERT_EQ(c.provenance.runs.size(), 1u);
  EXPECT_EQ(c.provenance.runs[0].sha256, "00ff");
}

TEST(CoefficientFile, ConvertsEveryCoefficientFromNewtonsPerRpmSquared) {
  const Coefficients si = parse_coefficients(kGood, "si");
  const Coefficients rpm = parse_coefficients(with(kGood, "N/(rad/s)^2", "N/RPM^2"), "rpm");
  const double scale = from_newtons_per_rpm2(1.0).value();
  EXPECT_DOUBLE_EQ(rpm.curve.thrust_coefficient() / si.curve.thrust_coefficient(), scale);
  EXPECT_DOUBLE_EQ(rpm.thrust_coefficient->u / si.thrust_coefficient->u, scale);
  EXPECT_DOUBLE_EQ(line_of(rpm.curve).intercept / line_of(si.curve).intercept, scale);
  EXPECT_DOUBLE_EQ(line_of(rpm.curve).slope_per_rad / line_of(si.curve).slope_per_rad, scale);
  EXPECT_DOUBLE_EQ(line_of(rpm.curve).uncertainty->covariance / line_of(si.curve).uncertainty->covariance,
                   scale * scale);
  EXPECT_DOUBLE_EQ(rpm.table[0].k / si.table[0].k, scale);
  EXPECT_DOUBLE_EQ(rpm.table[0].uncertainty->expanded_95 / si.table[0].uncertainty->expanded_95, scale);
}

TEST(CoefficientFile, GivesTheFit) {
  const std::string with_fit =
      with(kGood, "estimator: huber}",
           "estimator: huber, k_by: offset, weights: thrust, loss: none, speed_range_rpm: [3000.0, 17000.0], "
           "leave_out: [\"90:2:slipped\"], mounted_once: true, u: {clock: 1.0e-05}}");
  const Coefficients c = parse_coefficients(with_fit, "c.yaml");
  EXPECT_EQ(c.provenance.fit.k_by, "offset");
  EXPECT_EQ(c.provenance.fit.speed_range_rpm->second, 17000);
  EXPECT_EQ(c.provenance.fit.leave_out, std::vector<std::string>{"90:2:slipped"});
  EXPECT_TRUE(c.provenance.fit.mounted_once);
  ASSERT_TRUE(c.provenance.fit.bench);
  EXPECT_EQ(c.provenance.fit.bench->front().second, 1e-5);
  EXPECT_THAT(refusal_of(with(with_fit, "[3000.0, 17000.0]", "[3000.0]")), HasSubstr("speed_range_rpm"));
}

TEST(CoefficientFile, LetsKeysOfNewerWritersPass) {
  EXPECT_NO_THROW((void)parse_coefficients(kGood + "humidity: {percent: 40}\n", "c.yaml"));
  EXPECT_NO_THROW((void)parse_coefficients(with(kGood, "anchored: false", "anchored: false\n  f_test: 0.3"), "c.yaml"));
}

TEST(CoefficientFile, LeavesEmptyWhatIsUnknown) {
  const Coefficients c = parse_coefficients(with(kGood, "air_density_kg_m3: 1.2", "air_density_kg_m3: unknown"), "c");
  EXPECT_FALSE(c.air_density_kg_m3);
  const Coefficients imported =
      parse_coefficients(with(with(kGood, "id: 5x3", "id: \"unknown\""), "blades: 3", "blades: unknown"), "c");
  EXPECT_EQ(imported.propeller.id, "unknown") << "a text in quotes is a name";
  EXPECT_EQ(imported.propeller.blades, 0);
  const Coefficients bare = parse_coefficients(kGood.substr(0, kGood.find("table:")), "c");
  EXPECT_TRUE(bare.table.empty());
  EXPECT_TRUE(bare.provenance.runs.empty());
}

TEST(CoefficientFile, HandsItsOverlapMeasureAndItsUncertaintyToTheLine) {
  for (const OverlapMeasure measure : {OverlapMeasure::area_share, OverlapMeasure::load_share}) {
    const std::string text = with(kGood, "rim_arc", std::string(name_of(measure)));
    EXPECT_EQ(parse_coefficients(text, "c").curve.overlap(), measure);
  }
  const auto uncertainty = line_of(parse_coefficients(kGood, "c").curve).uncertainty;
  ASSERT_TRUE(uncertainty);
  EXPECT_EQ(uncertainty->thrust_coefficient, 1e-9);
  EXPECT_EQ(uncertainty->intercept_variance, 1e-18);
  EXPECT_DOUBLE_EQ(uncertainty->covariance, -5e-21 * 180 / kPi);
  EXPECT_DOUBLE_EQ(uncertainty->slope_variance, 4e-23 * (180 / kPi) * (180 / kPi));
  EXPECT_FALSE(parse_coefficients(with(kGood, "covariance:", "other:"), "c").curve.has_uncertainty());
}

TEST(CoefficientFile, IsRefusedWithTheLineAndTheReason) {
  struct Case {
    const char *from, *to;
    std::string begins, says = "";
  };
  for (const auto& [from, to, begins, says] : std::vector<Case>{
           {"k_unit: N/(rad/s)^2\n", "", "c.yaml", "unit"},
           {"N/(rad/s)^2", "gf/RPM^2", "c.yaml:5: ", "gf/RPM^2"},
           {"overlap: rim_arc\n", "", "c.yaml", "overlap: rim_arc"},
           {"rim_arc", "rim_share", "c.yaml:6: overlap `rim_share`"},
           {"[[1.0e-18,", "[[-1.0e-18,", "c.yaml:25: "},
           {"4.0e-23]]", "-4.0e-23]]", "c.yaml:25: "},
           {"[0.0, -5.0e-21, 4.0e-23]]", "[0.0, -5.0e-21]]", "c.yaml", "3 numbers"},
           {"u: 1.0e-09", "u: -1.0e-09", "c.yaml:7: "},
           {"u: 1.1e-09", "u: small", "c.yaml", "`u`"},
           {"format: kphi-coefficients/2\n", "", "c.yaml", "no `format`"},
           {"coefficients/2", "coefficients/1", "c.yaml:1: "},
           {"4.0e-23", ".nan", "c.yaml", "covariance"},
           {"blades: 3", "blades: -3", "c.yaml", "not a count"},
           {"k: 1.4e-06", "k: .nan", "c.yaml:17: "},
           {"phi_deg: 0.0}", "phi_deg: 45.0}", "c.yaml", "phi_deg is not 0"},
           {"k_unit:", "k_unit: N/RPM^2\nk_unit:", "c.yaml", "`k_unit` is given twice; keep one"},
           {"  intercept:", "  intercept: 1.0\n  intercept:", "c.yaml:12: "},
           {"[0.0, 270.0]", "[0.0, 360.1]", "c.yaml", "at most 360"},
           {"form: line", "form: spline", "c.yaml:9: form `spline`"},
           {"anchored: false", "anchored: true", "c.yaml", "anchored"},
           {"valid: {phi_deg:", "valid: {other:", "c.yaml", "`phi_deg`"},
       }) {
    EXPECT_THAT(refusal_of(with(kGood, from, to)), AllOf(StartsWith(begins), HasSubstr(says))) << from << " -> " << to;
  }
  for (const char* other : {"", "42", "[1, 2]", "format: [a", "\t", "format: {a: 1}", "just words"}) {
    EXPECT_THAT(refusal_of(other), StartsWith("c.yaml:1: ")) << other;
  }
}

TEST(CoefficientFile, IsRefusedWhenARequiredKeyIsMissing) {
  for (const std::string key :
       {"propeller", "K_T", "curve", "form", "valid", "value", "anchored", "intercept", "slope_per_deg"}) {
    EXPECT_THAT(refusal_of(with(kGood, key + ":", "other:")), HasSubstr("`" + key + "`"));
  }
}

TEST(CoefficientFile, IsRefusedWithAValueThatCannotBe) {
  for (const std::string bad :
       {".nan", "nan", ".inf", "inf", "-inf", "1e999", "much", "1.55e-06x", "0x10", "[1]", "{}", "~"}) {
    EXPECT_THAT(refusal_of(with(kGood, "value: 1.55e-06", "value: " + bad)), StartsWith("c.yaml:7: ")) << bad;
    EXPECT_THAT(refusal_of(with(kGood, "-4.5e-09", bad)), StartsWith("c.yaml:12: `value`")) << bad;
  }
  for (const std::string bad : {"0", "-1.55e-06"}) {
    EXPECT_THAT(refusal_of(with(kGood, "value: 1.55e-06", "value: " + bad)), HasSubstr("positive")) << bad;
    EXPECT_THAT(refusal_of(with(kGood, "{value: 1.6e-06", "{value: " + bad)), HasSubstr("positive")) << bad;
  }
  for (const char* bad : {"[270.0, 0.0]", "[0.0]", "[0.0, 400.0]", "[-5.0, 270.0]", "270.0", "[]", "[0.0, .nan]"}) {
    EXPECT_THAT(refusal_of(with(kGood, "[0.0, 270.0]", bad)), StartsWith("c.yaml:14: ")) << bad;
  }
  const std::string good = "[[1.0e-18, 0.0, 0.0], [0.0, 1.0e-18, -5.0e-21], [0.0, -5.0e-21, 4.0e-23]]";
  for (const char* bad : {"[[1, 2, 3], [1, 2, 3]]", "[[1, 2]]", "[1, 2]", "[[1, 2], [3, 4], [5, 6]]"}) {
    EXPECT_THAT(refusal_of(with(kGood, good, bad)), StartsWith("c.yaml:25: ")) << bad;
  }
}

std::string with_table(const std::string& knots) {
  return with(with(kGood, "form: line", "form: table"), "  points_deg:", "  knots: " + knots + "\n  points_deg:");
}

TEST(CoefficientFile, HoldsATable) {
  const Coefficients c = parse_coefficients(
      with_table("[{phi_deg: 0, value: 1.55e-06, u: 1e-9}, {phi_deg: 90, value: 1.2e-06, u: 2e-9}]"), "c.yaml");
  EXPECT_EQ(c.form, "table");
  EXPECT_NEAR(c.curve.at(from_degrees(45)).value(), 1.375e-6, 1e-18);
  EXPECT_NEAR(c.curve.standard_error_at(from_degrees(45)), 1.5e-9, 1e-18);
  EXPECT_EQ(to_degrees(c.curve.largest_fitted()), 270);
  EXPECT_EQ(words_of(c.curve), "1.55e-06 at 0, 1.2e-06 at 90 deg");
  EXPECT_EQ(c.parameters.back().key, "k(90)");
  EXPECT_FALSE(parse_coefficients(with_table("[{phi_deg: 0, value: 1.55e-06}, {phi_deg: 90, value: 1.2e-06}]"), "c")
                   .curve.has_uncertainty());
}

TEST(CoefficientFile, IsRefusedWithATableThatCannotBe) {
  const auto refusal = [](const std::string& knots) { return refusal_of(with_table(knots)); };
  EXPECT_THAT(refusal("[]"), HasSubstr("2 to 12 knots"));
  EXPECT_THAT(refusal("[{phi_deg: 0, value: 1.55e-06}]"), HasSubstr("2 to 12 knots"));
  EXPECT_THAT(refusal("[{phi_deg: 0, value: 1.5e-06}, {phi_deg: 90, value: 1.2e-06}]"), HasSubstr("is not K_T"));
  EXPECT_THAT(refusal("[{phi_deg: 10, value: 1.55e-06}, {phi_deg: 90, value: 1.2e-06}]"), HasSubstr("is not K_T"));
  EXPECT_THAT(refusal("[{phi_deg: 0, value: 1.55e-06}, {phi_deg: 90, value: 1.6e-06}]"), HasSubstr("rises"));
  EXPECT_THAT(refusal("[{phi_deg: 0, value: 1.55e-06}, {phi_deg: 0, value: 1.2e-06}]"), HasSubstr("ascend"));
  EXPECT_THAT(refusal("[{phi_deg: 0, value: 1.55e-06}, {phi_deg: 90, value: 0}]"), HasSubstr("positive"));
  EXPECT_THAT(refusal("[{phi_deg: 0, value: 1.55e-06}, 3]"), HasSubstr("a knot has no keys"));
}

TEST(CoefficientFile, HandsTheSpeedTrendAndTheTorqueToTheCurve) {
  const std::string more =
      "speed_trend: {share_per_1000_rpm: 0.01, u: 0.001, reference_rpm: 12000}\n"
      "torque: [{phi_deg: 0, k_q: 2e-8}, {phi_deg: 90, k_q: 1.8e-8}]\n";
  const Coefficients c = parse_coefficients(kGood + more, "c.yaml");
  EXPECT_NEAR(c.curve.speed_trend().factor_at(from_rpm(17000).value()), 1.05, 1e-12);
  EXPECT_NEAR(c.curve.torque_share_at(from_degrees(45)), 0.95, 1e-12);
  EXPECT_EQ(parse_coefficients(kGood, "c.yaml").curve.torque_share_at(from_degrees(45)), 1);
  EXPECT_THAT(refusal_of(with(kGood + more, "0.01", "0.1")), HasSubstr("more than 0.3"));
  EXPECT_THAT(refusal_of(with(kGood + more, "12000", "-1")), HasSubstr("not positive"));
  EXPECT_THAT(refusal_of(with(kGood + more, "1.8e-8", "1.8e-6")), HasSubstr("ten times"));
}

TEST(CoefficientFile, HoldsOcclusionsOfOneTurnAtMost) {
  EXPECT_EQ(parse_coefficients(with(kGood, "[0.0, 270.0]", "[0.0, 360.0]"), "c.yaml").curve.largest_fitted(),
            from_degrees(360));
}

TEST(CoefficientFile, HoldsAnAnchoredLineToOnePartInAMillion) {
  const std::string anchored = with(kGood, "anchored: false", "anchored: true");
  EXPECT_TRUE(parse_coefficients(with(anchored, "1.6e-06", "1.55e-06"), "c.yaml").anchored);
  EXPECT_TRUE(parse_coefficients(with(anchored, "1.6e-06", "1.550001e-06"), "c.yaml").anchored);
  EXPECT_THAT(refusal_of(with(anchored, "1.6e-06", "1.549997e-06")), HasSubstr("its k(0) is not K_T"));
}

TEST(CoefficientFile, SurvivesBeingCutAnywhere) {
  for (std::size_t length = 0; length < kGood.size(); ++length) {
    try {
      (void)parse_coefficients(kGood.substr(0, length), "c.yaml");
    } catch (const CoefficientError&) {
    }
  }
}

TEST(CoefficientFile, IsNoTreeWithoutEndMadeOfAFewBytes) {
  std::string wide = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string one = "*a" + std::to_string(i - 1);
    wide += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + one;
    for (int n = 1; n < 10; ++n) wide += ", " + one;
    wide += "]\n";
  }
  for (const std::string& text : {std::string("a: &a {b: *a}\n"), std::string("a: &a [*a, *a]\n"), wide})
    EXPECT_THAT([&] { (void)parse_coefficients(text, "c.yaml"); },
                testing::ThrowsMessage<CoefficientError>(HasSubstr("nested too deep or too long")))
        << text;
}

TEST(CoefficientFile, ThatCannotBeReadIsNamed) {
  for (const char* path : {"/nonexistent/c.yaml", "/", "/dev/zero"}) {
    EXPECT_THAT([&] { (void)load_coefficients(path); }, testing::ThrowsMessage<CoefficientError>(StartsWith(path)));
  }
}

TEST(CoefficientFile, OfTheConsumerProjectIsRead) {
  const Coefficients c = load_coefficients(kphi::test::source_dir() + "/test/consumer/coefficients.yaml");
  EXPECT_NEAR(to_newtons_per_rpm2(c.curve.thrust_coefficient()), 1.7e-8, 1e-20);
}

}  // namespace coefficient_file_test
}  // namespace kphi::compensation
