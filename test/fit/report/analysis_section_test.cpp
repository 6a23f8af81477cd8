#include "fit/report/analysis_section.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <pugixml.hpp>

#include "fit/report/html.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

bool well_formed(const std::string& html) {
  pugi::xml_document document;
  return static_cast<bool>(document.load_string(("<div>" + html + "</div>").c_str()));
}

Analysis analysis() { return analyse(identify(campaign_steps())); }

TEST(AnalysisSections, ShowEveryRowOfTheBudgetAndWhatNobodyKnows) {
  const Analysis found = analysis();
  const std::string html = analysis_sections(found);
  ASSERT_TRUE(well_formed(html));
  EXPECT_THAT(html, HasSubstr("Uncertainty budget"));
  for (const BudgetRow& row : found.coefficients.front().rows)
    EXPECT_THAT(html, HasSubstr(">" + typeset(row.source) + "<"));
  EXPECT_THAT(html, HasSubstr("not known")) << "nobody gave the calibration of the cell";
  EXPECT_THAT(html, HasSubstr("combined u"));
}

TEST(AnalysisSections, TellHowSureStandardAirIsWhereTheAirIsKnown) {
  AnalysisOptions options;
  EXPECT_THAT(analysis_sections(analyse(identify(campaign_steps()), options)), Not(HasSubstr("in standard air, 95 %")));
  options.air_density_kg_m3 = 1.18;
  options.bench.air_density = 0.002;
  const std::string html = analysis_sections(analyse(identify(campaign_steps()), options));
  ASSERT_TRUE(well_formed(html));
  EXPECT_THAT(html, HasSubstr("in standard air, 95 %"));
}

TEST(AnalysisSections, ShowTestsWithTheirVerdicts) {
  Analysis found = analysis();
  EXPECT_THAT(analysis_sections(found), HasSubstr(">stands<"));
  found.curvature.lack_of_fit = {"line <bent>", "k is a line", "F", 99, 2, 10, 1e-7};
  const std::string html = analysis_sections(found);
  ASSERT_TRUE(well_formed(html));
  EXPECT_THAT(html, HasSubstr("line &lt;bent&gt;"));
  EXPECT_THAT(html, HasSubstr("&lt; 0.0001"));
  EXPECT_THAT(html, HasSubstr(">rejected<"));
}

TEST(AnalysisSections, LeaveOutWhatIsNotThere) {
  EXPECT_THAT(analysis_sections({}), Not(HasSubstr("<h2>")));
  EXPECT_EQ(claims_section({}), "");
}

TEST(AnalysisSections, ListClaimsWithIntervalAndVerdict) {
  const std::vector<Claim> claims{{"a", "slopes <equal>", "1", 1.02, 0.98, 1.06, 0.9, 1.1, Verdict::holds},
                                  {"b", "not here", "1"}};
  const std::string html = claims_section(claims);
  ASSERT_TRUE(well_formed(html));
  EXPECT_THAT(html, HasSubstr("<td>1.02</td><td>0.98 to 1.06</td><td>0.9 to 1.1</td>"));
  EXPECT_THAT(html, HasSubstr("slopes &lt;equal&gt;"));
  EXPECT_THAT(html, HasSubstr("not tested"));
}

}  // namespace
}  // namespace kphi::fit
