#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "base/error.hpp"
#include "fit/logs/import_table.hpp"
#include "fit/model/table_line.hpp"

namespace kphi::fit {
namespace coefficient_table_test {

using ::testing::HasSubstr;

TEST(UiucTable, TakesTheDiameterFromTheName) {
  EXPECT_EQ(diameter_from_name("apcff_4.2x4_static_0615rd.txt"), 4.2);
  EXPECT_EQ(diameter_from_name("apcsf_10x7_static_kt0827.txt"), 10);
  for (const char* none : {"static.txt", "xx", "", "a_0x3.txt"}) EXPECT_FALSE(diameter_from_name(none)) << none;
}

TEST(UiucTable, TurnsTheCoefficientIntoThrust) {
  const auto imported = read_uiuc("RPM CT CP\r\n6000 0.1 0.05\r\n", "apc_10x7_s.txt");
  EXPECT_NEAR(imported.step(0).thrust_n, 0.1 * 1.225 * 100 * 100 * std::pow(0.254, 4), 1e-12);
  EXPECT_NEAR(imported.step(0).speed_rad_s, 628.3185307, 1e-6);
  EXPECT_THROW((void)read_uiuc("RPM CT\n6000 0.1\n", "table.txt"), ConfigurationError) << "no diameter";
  EXPECT_NO_THROW((void)read_uiuc("RPM CT\n6000 0.1\n", "table.txt", 10));
  EXPECT_THROW((void)read_uiuc("RPM CP\n6000 0.1\n", "a_10x7.txt"), ConfigurationError);
}

TEST(KTable, ReadsCoefficientsInBothUnits) {
  const auto si = read_k_table("phi_deg,k_n_s2_per_rad2,u_k_n_s2_per_rad2\n0,1.55e-6,1e-9\n45,1.4e-6,2e-9\n", "K.csv");
  ASSERT_EQ(si.size(), 2u);
  EXPECT_EQ(si[1].k, 1.4e-6);
  EXPECT_EQ(si[1].standard_error, 2e-9);
  const auto rpm = read_k_table("phi_deg,k_n_per_rpm2\n0,1.7e-8\n", "K.csv");
  EXPECT_NEAR(rpm[0].k, 1.7e-8 * 91.189065, 1e-12);
  EXPECT_EQ(rpm[0].standard_error, 0);
  EXPECT_EQ(read_k_table("phi_deg,k_n_per_rpm2,u_k_n_per_rpm2\n0,1.7e-8,\n", "K.csv")[0].standard_error, 0)
      << "unknown";
}

TEST(KTable, NeverAssumesAUnit) {
  constexpr const char* kBare = "phi_deg,k,u_k\n0,1.7e-8,1e-9\n";
  EXPECT_THAT([] { (void)read_k_table(kBare, "K.csv"); },
              testing::ThrowsMessage<ConfigurationError>(HasSubstr("K.csv:1: the unit of k is not known")));
  EXPECT_EQ(read_k_table(kBare, "K.csv", "N/(rad/s)^2")[0].k, 1.7e-8);
  EXPECT_NEAR(read_k_table(kBare, "K.csv", "N/RPM^2")[0].k, 1.7e-8 * 91.189065, 1e-12);
  EXPECT_NEAR(read_k_table(kBare, "K.csv", "N/RPM^2")[0].standard_error, 1e-9 * 91.189065, 1e-13);
  for (const char* twice : {"phi_deg,k,k_n_per_rpm2\n", "phi_deg,k_n_s2_per_rad2,k_n_per_rpm2\n"})
    EXPECT_THROW((void)read_k_table(twice, "K.csv", "N/RPM^2"), ConfigurationError) << twice;
  EXPECT_THROW((void)read_k_table("phi_deg,k_n_per_rpm2\n0,1\n", "K.csv", "N/RPM^2"), ConfigurationError);
}

TEST(KTable, NamesTheLineThatIsWrong) {
  for (const char* bad : {"phi_deg\n0\n", "k\n1\n", "phi_deg,k\n0\n", "phi_deg,k\n0,x\n", "phi_deg,k\n-1,1e-6\n",
                          "phi_deg,k\n0,-1e-6\n", ""}) {
    EXPECT_THROW((void)read_k_table(bad, "K.csv", "N/(rad/s)^2"), ConfigurationError) << bad;
  }
  EXPECT_THAT([&] { (void)read_k_table("phi_deg,k\n0,1e-6\n45,abc\n", "K.csv", "N/(rad/s)^2"); },
              testing::ThrowsMessage<ConfigurationError>(HasSubstr("K.csv:3")));
  EXPECT_THAT([&] { (void)read_k_table("phi_deg,k\n0,1e-6\n45\n", "K.csv", "N/(rad/s)^2"); },
              testing::ThrowsMessage<ConfigurationError>(testing::StrEq("K.csv:3: 1 fields where the header has 2")));
  EXPECT_TRUE(is_k_table("phi_deg,k\n"));
  EXPECT_FALSE(is_k_table("propeller,blades\n"));
}

TEST(RepeatedAngles, AreAveragedWithTheirPooledScatterAsTheError) {
  const std::vector<CurvePoint> table{{90, 1.02, 0}, {0, 2, 0}, {90, 0.98, 0}, {180, 0.5, 0}};
  const RepeatedAngles found = average_repeated(table);
  ASSERT_EQ(found.points.size(), 3u);
  EXPECT_EQ(found.angles, 1u);
  EXPECT_EQ(found.rows, 2u);
  EXPECT_FALSE(found.weighted);
  EXPECT_NEAR(found.points[1].k, 1, 1e-15);
  EXPECT_NEAR(found.scatter, 0.02 * std::sqrt(2), 1e-12);
  // Student's factor of one degree of freedom, 12.706, over 1.960.
  EXPECT_NEAR(found.points[0].standard_error, 2 * 0.02 * std::sqrt(2) * 12.7062 / 1.95996, 1e-5);
  EXPECT_NEAR(found.points[1].standard_error, 0.02 * 12.7062 / 1.95996, 1e-5);
  EXPECT_THAT(found.words(), HasSubstr("1 of 3 angles are listed more than once, in 2 rows"));
  const RepeatedAngles plain = average_repeated(std::vector<CurvePoint>{{0, 2, 0.1}, {90, 1, 0.1}});
  EXPECT_EQ(plain.angles, 0u);
  EXPECT_EQ(plain.points[1].standard_error, 0.1);
}

TEST(RepeatedAngles, AreWeightedByTheirErrorsWhichScatterMayEnlarge) {
  const RepeatedAngles as_told = average_repeated(std::vector<CurvePoint>{{0, 2, 0.1}, {90, 1, 0.1}, {90, 1.01, 0.2}});
  EXPECT_TRUE(as_told.weighted);
  EXPECT_NEAR(as_told.points[1].k, (1 * 4 + 1.01) / 5, 1e-12);
  EXPECT_NEAR(as_told.points[1].standard_error, 1 / std::sqrt(100 + 25), 1e-12);
  const RepeatedAngles more = average_repeated(std::vector<CurvePoint>{{0, 2, 0.1}, {90, 1, 0.1}, {90, 2, 0.1}});
  EXPECT_NEAR(more.scatter, 5 * std::sqrt(2), 1e-12);
  EXPECT_NEAR(more.points[1].standard_error, 5 * std::sqrt(2) * 0.1 / std::sqrt(2), 1e-12);
  EXPECT_NEAR(more.points[0].standard_error, 5 * std::sqrt(2) * 0.1, 1e-12) << "its u come from the same hand";
}

TEST(RepeatedAngles, HoldTheTruthInNineteenOfTwentyTables) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  int within = 0;
  constexpr int kTables = 2000;
  for (int i = 0; i < kTables; ++i) {
    std::vector<CurvePoint> table;
    for (const double phi : {0.0, 45.0, 90.0})
      for (int row = 0; row < 2; ++row) table.push_back({phi, (2 - phi / 100) * (1 + 0.01 * normal(random)), 0});
    const CurvePoint K_T = average_repeated(table).points.front();
    within += std::abs(K_T.k - 2) <= 1.96 * K_T.standard_error ? 1 : 0;
  }
  EXPECT_NEAR(within / static_cast<double>(kTables), 0.95, 0.015) << "three deviations";
}

TEST(Tables, NoMutationOfATableCrashesAReader) {
  const std::string seeds[] = {
      "\xEF\xBB\xBFTime (s),ESC (µs),Thrust (gf),Motor Electrical Speed (RPM),Motor Optical Speed (RPM),App message,\n"
      "0,1050,6.07,0,0,,\n2.2,1145,14.6,3853,0,\"a,b\",\n3.9,1240,29.2,5196,0,,\n",
      "RPM CT CP\r\n1490.0 0.11 0.05\r\n3000 0.12 0.06\r\n", "phi_deg,k,u_k\n0,1.55e-6,1e-9\n45,1.4e-6,2e-9\n"};
  std::mt19937 random(42);
  std::size_t accepted = 0, refused = 0;
  for (int trial = 0; trial < 30000; ++trial) {
    std::string text = seeds[trial % 3];
    const int edits = 1 + static_cast<int>(random() % 6);
    for (int i = 0; i < edits && !text.empty(); ++i) {
      const std::size_t at = random() % text.size();
      const char bytes[] = {',', '"', '\n', '\r', ' ', '\0', '-', 'e', '9', static_cast<char>(random())};
      const auto edit = random() % 4;
      if (edit == 0) text[at] = bytes[random() % 10];
      if (edit == 1) text.insert(at, 1, bytes[random() % 10]);
      if (edit == 2) text.erase(at, 1 + random() % 4);
      if (edit == 3) text.insert(at, text.substr(random() % text.size(), random() % 40));
    }
    try {
      accepted += trial % 3 == 0   ? select_rows(read_log(text, "x.csv")).size()
                  : trial % 3 == 1 ? read_uiuc(text, "apc_5x4_x.txt").size()
                                   : read_k_table(text, "K.csv", "N/RPM^2").size();
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(accepted, 0u);
  EXPECT_GT(refused, 0u);
}

}  // namespace coefficient_table_test
}  // namespace kphi::fit
