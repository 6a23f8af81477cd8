// The paper's four campaigns on the deterministic bench, from the campaign files themselves with shorter sweeps,
// through recording, reduction and fit: its statements as a table, and the truth that the bench was built with.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "base/error.hpp"
#include "daq/campaign/campaign_run.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "drivers/sim/physics/truth.hpp"
#include "fit/propellers/claims.hpp"
#include "results/steps_csv.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/source_dir.hpp"

namespace kphi::fit {
namespace four_propellers_test {

using ::testing::HasSubstr;

/// 8 steps of 0.8 s, twice, instead of 40 of 2 s three times.
profiles::Campaign shortened(const std::string& name) {
  std::string text = test::bytes_of(test::source_dir() + "/profiles/" + name + ".yaml");
  for (const auto& [from, to] :
       {std::pair<std::string, const char*>("repetitions: 3", "repetitions: 2\nrepetitions_extra_max: 0"),
        {"steps: 40", "steps: 8"},
        {"dwell_s: 2.0", "dwell_s: 0.8"},
        {"zero_s: 2.0", "zero_s: 1.0"},
        {"minimum_discard_s: 1.0", "minimum_discard_s: 0.4"}})
    text.replace(text.find(from), from.size(), to);
  return profiles::parse_campaign(text, name);
}

Fitted measured(const std::string& name, int seed) {
  const test::TemporaryFolder folder;
  const profiles::BenchConfig config = test::deterministic_config(seed);
  daq::DeterministicBench bench(config, sim::BenchSettings{});
  const auto results = results::CampaignFolder::create(folder.path(), "20210530T000000Z", name);
  daq::AutoConfirmOperator person;
  daq::Progress silence;
  (void)daq::run_campaign(bench, shortened(name), config, results, person, silence, [] { return false; });
  Identification found = identify(results::read_steps(results.steps()));
  AnalysisOptions options;
  options.bench = BenchUncertainty::none();
  options.bench.motor_clock = 2e-4;
  Analysis analysis = analyse(found, options);
  return {std::move(found), std::move(analysis)};
}

const std::vector<Fitted>& four() {
  static const std::vector<Fitted> members{measured("icra2021_5in_2blade", 21), measured("icra2021_5in_3blade", 22),
                                           measured("icra2021_6in_2blade", 23), measured("icra2021_6in_3blade", 24)};
  return members;
}

void expect_the_papers_statements() {
  const FamilyFindings findings = findings_of(four(), {});
  const std::string table = family_text(findings);
  fmt::print("{}", table);
  const auto &p52 = *sim::find_propeller("5x2"), &p53 = *sim::find_propeller("5x3"), &p62 = *sim::find_propeller("6x2"),
             &p63 = *sim::find_propeller("6x3");
  const std::map<std::string, double> truth{
      {"share_45", sim::thrust_coefficient(p53, 45) / sim::thrust_coefficient(p53, 0)},
      {"share_270", sim::thrust_coefficient(p53, 270) / sim::thrust_coefficient(p53, 0)},
      {"slopes_5in", p53.line_slope_n_rpm2_deg / p52.line_slope_n_rpm2_deg},
      {"slopes_6in", p63.line_slope_n_rpm2_deg / p62.line_slope_n_rpm2_deg},
      {"offset_5in", p53.thrust_n_rpm2 - p52.thrust_n_rpm2},
      {"offset_6in", p63.thrust_n_rpm2 - p62.thrust_n_rpm2}};
  std::size_t tested = 0;
  for (const Claim& claim : findings.claims) {
    EXPECT_EQ(claim.verdict, Verdict::holds) << claim.id << ": " << claim.value;
    EXPECT_THAT(table, HasSubstr(claim.statement));
    if (const auto known = truth.find(claim.id); known != truth.end()) {
      EXPECT_NEAR(claim.value / known->second, 1, 0.02) << claim.id;
      ++tested;
    }
  }
  EXPECT_EQ(tested, truth.size());
  EXPECT_EQ(findings.claims.size(), 16u);
}

void expect_shared_slopes() {
  const FamilyFindings findings = findings_of(four(), {});
  ASSERT_EQ(findings.slopes.size(), 2u);
  const double per_rpm = from_newtons_per_rpm2(1).value();
  for (std::size_t i = 0; i < 2; ++i) {
    const double truth = sim::find_propeller(i == 0 ? "5x3" : "6x3")->line_slope_n_rpm2_deg * per_rpm;
    EXPECT_NEAR(findings.slopes[i].slope.value / truth, 1, 0.01);
    EXPECT_FALSE(findings.slopes[i].equal_slopes.p < 0.01);
    EXPECT_LE(std::abs(findings.slopes[i].slope.value - truth), findings.slopes[i].expanded());
    EXPECT_GT(findings.slopes[i].common_u, 0) << "a clock at least is the same for all of them";
  }
}

void expect_a_fifth_one_between() {
  const std::vector<PropellerSize> sizes{parse_propeller_size("5.5x3")};
  const FamilyFindings findings = findings_of(four(), sizes);
  ASSERT_EQ(findings.predictions.size(), 5u);
  for (const FamilyPrediction& one : findings.predictions) {
    const double below = sim::thrust_coefficient(*sim::find_propeller("5x3"), one.phi_deg);
    const double above = sim::thrust_coefficient(*sim::find_propeller("6x3"), one.phi_deg);
    EXPECT_GT(one.k.value, below) << one.phi_deg;
    EXPECT_LT(one.k.value, above) << one.phi_deg;
    EXPECT_LT(one.lower, one.k.value);
  }
  EXPECT_THAT(family_text(findings), HasSubstr("5.5x3 at 90 deg"));
  EXPECT_THROW((void)findings_of(std::span(four()).first(2), sizes), ConfigurationError);
}

void expect_that_mixed_up_ones_fail() {
  auto members = four();
  std::swap(members[0].identification.blades, members[1].identification.blades);
  std::map<std::string, Verdict> verdicts;
  for (const Claim& claim : test_claims(members)) verdicts[claim.id] = claim.verdict;
  EXPECT_EQ(verdicts.at("offset_5in"), Verdict::fails);
  EXPECT_EQ(verdicts.at("order_5in"), Verdict::fails);
  EXPECT_EQ(verdicts.at("offset_6in"), Verdict::holds);
}

/// One test, since each would run the four campaigns again.
TEST(FourPropellers, BearOutThePapersStatementsAndTheBenchsTruth) {
  expect_the_papers_statements();
  expect_shared_slopes();
  expect_a_fifth_one_between();
  expect_that_mixed_up_ones_fail();
}

}  // namespace four_propellers_test
}  // namespace kphi::fit
