#include "fit/report/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <pugixml.hpp>
#include <random>
#include <set>
#include <string>

#include "base/number.hpp"
#include "fit/report/analysis_sections.hpp"
#include "fit/report/family_sections.hpp"
#include "fit/report/figures.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/report/gnuplot.hpp"
#include "fit/report/html.hpp"
#include "results/file_layer.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/gnuplot.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace report_test {

using results::QualityFlag;
using test::gnuplot_is_installed;
using test::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::Not;

Provenance provenance() {
  Provenance result;
  result.measured_utc = "2021-05-30T00:00:00Z";
  result.tool_version = "0.1.0";
  result.campaign = "icra <script>alert(1)</script> & \"co\"";
  result.propeller_name = "Tom's 5x4 & more";
  result.source = "steps.csv";
  SampleAccount account;
  account.expected = 560000;
  account.received = 559990;
  account.lost_network = 7;
  account.lost_host = 3;
  result.runs = {{"runs/5x3_phi000_rep1.h5", std::string(64, 'a'), "complete", account},
                 {"runs/5x3_phi045_rep1.h5", std::string(64, 'b'), "", std::nullopt}};
  return result;
}

void expect_words(const std::string& text, std::initializer_list<std::string> words) {
  for (const std::string& one : words) EXPECT_THAT(text, HasSubstr(one));
}

std::vector<results::StepMean> steps_with_flags() {
  auto steps = campaign_steps();
  steps[39].quality_flags = static_cast<std::uint32_t>(QualityFlag::speed_not_reached);
  steps[38].quality_flags = static_cast<std::uint32_t>(QualityFlag::lost_samples);
  return steps;
}

std::string page(const Figures& figures = {}) {
  return format_report(analysed(identify(steps_with_flags())), {provenance(), figures});
}

pugi::xml_document parsed(const std::string& xml) {
  pugi::xml_document document;
  const auto result = document.load_buffer(xml.data(), xml.size(), pugi::parse_default | pugi::parse_doctype);
  EXPECT_TRUE(result) << result.description() << " at " << result.offset;
  return document;
}

/// Every attribute that makes a browser load something.
void expect_no_loads(const pugi::xml_node& node) {
  for (const pugi::xml_attribute attribute : node.attributes()) {
    const std::string name = attribute.name(), value = attribute.value();
    if (name == "src" || name == "href" || name == "xlink:href" || name == "data" || name == "srcset") {
      EXPECT_TRUE(value.starts_with('#')) << node.name() << ' ' << name << '=' << value;
    }
    if (!name.starts_with("xmlns")) {
      EXPECT_EQ(value.find("http"), std::string::npos) << value;
    }
  }
  for (const pugi::xml_node child : node.children()) expect_no_loads(child);
}

TEST(Html, EscapesMarkup) {
  EXPECT_EQ(html_escaped("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
  EXPECT_EQ(html_escaped("φ = 45° ± 1 µs"), "φ = 45° ± 1 µs");
}

TEST(Html, ReplacesWhatXmlDoesNotAllow) {
  EXPECT_EQ(html_escaped(std::string("a\0b\x1b", 4)),
            "a\xEF\xBF\xBD"
            "b\xEF\xBF\xBD");
  for (const char* bad : {"\xC3", "\xC0\x80", "\xED\xA0\x80", "\xF5\x80\x80\x80", "\xEF\xBF\xBF", "\x80"})
    EXPECT_EQ(html_escaped(bad).rfind("\xEF\xBF\xBD", 0), 0u);
}

TEST(Html, NoBytesBreakThePage) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    std::string text;
    for (int i = 0; i < 30; ++i) text += static_cast<char>(random());
    const auto document = parsed("<p a=\"" + html_escaped(text) + "\">" + html_escaped(text) + "</p>");
    EXPECT_EQ(std::distance(document.child("p").begin(), document.child("p").end()), 1);
  }
}

TEST(Html, SetsWhatPlainTextWritesInAscii) {
  EXPECT_EQ(typeset("K_T: T = k w^2 at phi = 45 deg, 1e-8 N/RPM^2 <b>"),
            "K<sub>T</sub>: T = k ω² at φ = 45°, 1e-8 N/RPM² &lt;b&gt;");
  EXPECT_EQ(typeset("measure phi with `kphi fit --u` <b>"), "measure φ with <code>kphi fit --u</code> &lt;b&gt;");
  EXPECT_EQ(typeset("one ` alone"), "one ` alone");
  EXPECT_EQ(typeset("many degrees of Delphi"), "many degrees of Delphi");
  EXPECT_EQ(typeset("5x3_phi000_rep1.h5 at phi"), "5x3_phi000_rep1.h5 at φ") << "names of files stay as they are";
}

TEST(Html, WritesPowersOfTenAsPeopleDoAndTheDigitsThatTheErrorAllows) {
  EXPECT_EQ(with_power_of_ten(1.550197e-6, 2.7e-11), "(1.550197 ± 0.000027) × 10⁻⁶");
  EXPECT_EQ(with_power_of_ten(-4.5e-9, 0), "−4.50000 × 10⁻⁹");
  EXPECT_EQ(with_power_of_ten(0, 1), "0.00000e+00");
  EXPECT_EQ(with_error(1.5512345e-6, 1.2e-9), "1.5512e-06 ± 1.2e-09");
  EXPECT_EQ(with_error(-4.4567e-9, 3e-11), "-4.457e-09 ± 3.0e-11");
  EXPECT_EQ(with_error(1.5e-6, 0), "1.50000e-06");
  EXPECT_EQ(with_error(0, 1), "0.00000e+00");
}

TEST(Html, PrefixesIdsAndReferencesOfDrawings) {
  const std::string svg = inline_svg(
      "<?xml version=\"1.0\"?><!DOCTYPE svg><svg xmlns=\"http://www.w3.org/2000/svg\"><circle id=\"p\"/>"
      "<use xlink:href='#p'/><g fill=\"url(#q)\"/></svg>",
      "f1-");
  expect_words(svg, {"id=\"f1-p\"", "\"#f1-p\"", "url(#f1-q)"});
  EXPECT_THAT(svg, Not(HasSubstr("DOCTYPE")));
  EXPECT_EQ(inline_svg("no svg", "f1-"), "");
}

TEST(Report, IsWellFormedAndLoadsNothing) {
  const std::string html = page();
  const pugi::xml_document document = parsed(html);
  EXPECT_TRUE(document.select_nodes("//script").empty());
  EXPECT_TRUE(document.select_nodes("//link").empty());
  expect_no_loads(document.child("html"));
  EXPECT_THAT(html, Not(HasSubstr("@import")));
  EXPECT_THAT(html, HasSubstr("@media print"));
}

TEST(Report, TellsHeadlineTableFlagsRunsAndProvenanceAndNamesAsTextOnly) {
  const std::string html = page();
  expect_words(
      html, {"k(0), without occlusion</h3><div class=\"value\">(1.5", ") × 10⁻⁶", "N/(rad/s)²", "N/RPM²", "<td>0°</td>",
             "<td>45°</td>", "<td>90°</td>", "<td>180°</td>", "<td>270°</td>", "commanded speed not reached",
             "<td class=\"text\">left out</td>", "<td class=\"text\">kept</td>",
             "<td>560000</td><td>559990</td><td>10</td>", std::string(64, 'b'), "2021-05-30T00:00:00Z", "kphi 0.1.0",
             "&lt;script&gt;alert(1)&lt;/script&gt; &amp; &quot;co&quot;", "Tom&#39;s 5x4 &amp; more"});
}

TEST(Report, ListsEveryFlagEventAndRejectionWithItsRun) {
  Provenance told = provenance();
  told.runs[0].events = {"3.20 s: restarted, the stream <began> anew"};
  told.rejected = {{"5x3_phi090_rep2.h5", "2021-05-30T00:10:00Z", "speed error & more"}};
  const std::string html = format_report(analysed(identify(steps_with_flags())), {told, {}});
  expect_words(html, {"3.20 s: restarted, the stream &lt;began&gt; anew", "not accepted",
                      "2021-05-30T00:10:00Z: speed error &amp; more", "samples lost; commanded speed not reached"});
}

class Figure : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!gnuplot_is_installed()) GTEST_SKIP() << "gnuplot is not installed";
  }
  const TemporaryFolder folder;
  const Identification fit = identify(campaign_steps());
};

TEST_F(Figure, OfSeveralCampaignsIsInOnePage) {
  const CampaignTruth truth;
  std::vector<Fitted> family{
      analysed(fit), analysed(identify(campaign_steps({2 * truth.K_T, 2 * truth.intercept, 2 * truth.slope_per_deg})))};
  family[1].identification.propeller = "6x3 <b>";
  std::vector<Chapter> chapters;
  for (const Fitted& one : family) {
    chapters.push_back({provenance(), draw_figures(one, shares_of_steps(one.identification),
                                                   folder.path() / one.identification.propeller)});
  }
  const std::string html = format_reports(family, chapters, draw({family_figure(family)}, folder.path()));
  const pugi::xml_document document = parsed(html);
  EXPECT_EQ(document.select_nodes("//svg").size(), 9u);
  std::set<std::string> ids;
  for (const pugi::xpath_node& node : document.select_nodes("//*[@id]"))
    EXPECT_TRUE(ids.insert(node.node().attribute("id").value()).second) << node.node().attribute("id").value();
  for (const pugi::xpath_node& link : document.select_nodes("//nav/a"))
    EXPECT_TRUE(ids.contains(std::string(link.node().attribute("href").value()).substr(1)));
  expect_no_loads(document.child("html"));
  EXPECT_THAT(html, HasSubstr("6x3 &lt;b&gt;"));
  EXPECT_GT(html.find(">Appendix: "), html.rfind("id=\"chapter")) << "behind all chapters";
}

TEST(Report, SaysWhyFiguresAreMissingAndHowToGetThem) {
  const TemporaryFolder folder;
  const Identification fit = identify(campaign_steps());
  const Figures figures =
      draw_figures(analysed(fit), shares_of_steps(fit), folder.path() / "figures", "no-such-gnuplot");
  EXPECT_TRUE(figures.drawn.empty());
  EXPECT_THAT(figures.skipped, HasSubstr("apt install gnuplot-nox"));
  EXPECT_THAT(page(figures), HasSubstr("Figures skipped: gnuplot is not installed"));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "figures/thrust_share.gp"))
      << "the script stays, to draw by hand";
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "figures/thrust_share.svg"));
}

TEST_F(Figure, IsDrawnAsSvgWithScriptAndDataBesideIt) {
  const Figures figures = draw_figures(analysed(fit), shares_of_steps(fit), folder.path());
  EXPECT_EQ(figures.skipped, "");
  ASSERT_EQ(figures.drawn.size(), 4u);
  for (const DrawnFigure& figure : figures.drawn) {
    pugi::xml_document document;
    ASSERT_TRUE(document.load_file(figure.svg.c_str()));
    EXPECT_FALSE(document.select_nodes("//path").empty());
    for (const char* ending : {".gp", ".csv"})
      EXPECT_GT(std::filesystem::file_size(std::filesystem::path(figure.svg).replace_extension(ending)), 100u);
  }
  const std::string html = page(figures);
  const pugi::xml_document document = parsed(html);
  EXPECT_EQ(document.select_nodes("//svg").size(), 4u);
  expect_no_loads(document.child("html"));
}

TEST_F(Figure, IsTheSameBytesForTheSameSteps) {
  const TemporaryFolder other;
  const Figures first = draw_figures(analysed(fit), shares_of_steps(fit), folder.path());
  const Figures second = draw_figures(analysed(fit), shares_of_steps(fit), other.path());
  ASSERT_EQ(first.drawn.size(), second.drawn.size());
  for (std::size_t i = 0; i < first.drawn.size(); ++i)
    EXPECT_EQ(results::read_text(first.drawn[i].svg), results::read_text(second.drawn[i].svg));
  EXPECT_EQ(page(first), page(second));
}

TEST_F(Figure, OfTheSharesHasOnRequestThePapersValuesAndAnEarlierCampaign) {
  Fitted ours = analysed(fit);
  const Fitted earlier = analysed(identify(campaign_steps({1.5e-6, 1.5e-6, -4e-9})));
  ours.identification.diameter_in = 5;
  ours.identification.blades = 3;
  DrawnBeside beside;
  beside.earlier = &earlier;
  beside.earlier_words = "monday_phi (simulated, 2021-05-30)";
  beside.paper = true;
  const Figures figures = draw_figures(ours, shares_of_steps(fit), folder.path(), "gnuplot", beside);
  ASSERT_EQ(figures.skipped, "");
  expect_words(figures.drawn.at(0).caption,
               {"Grey rings: k of an earlier campaign, monday_phi (simulated, 2021-05-30).",
                "the paper's values of this propeller, almost 90 % at 45° and 25 % at 270°"});
  const std::string csv = results::read_text(folder.path() / "thrust_share.csv");
  expect_words(csv, {"earlier_k_n_s2_per_rad2,0,", "paper_percent,45,90,", "paper_percent,270,25,"});
  ours.identification.blades = 2;
  EXPECT_THAT(draw_figures(ours, shares_of_steps(fit), folder.path(), "gnuplot", beside).drawn.at(0).caption,
              Not(HasSubstr("paper")));
}

TEST(Report, HasTheStatementsThatOnePropellerCanTestOnRequestAlone) {
  Fitted ours = analysed(identify(campaign_steps()));
  ours.identification.diameter_in = 5;
  ours.identification.blades = 3;
  Chapter chapter{provenance(), {}};
  EXPECT_THAT(format_report(ours, chapter), Not(HasSubstr("almost 90 %")));
  chapter.claims = true;
  const std::string html = format_report(ours, chapter);
  (void)parsed(html);
  expect_words(html, {"The paper's statements", "5-inch 3-blade at 270°: 25 % of its thrust"});
  EXPECT_THAT(html, Not(HasSubstr("not tested")));
  EXPECT_THAT(html, AllOf(HasSubstr(">Appendix<"), Not(HasSubstr("<details")))) << "it prints";
}

TEST_F(Figure, OfABareTableShowsTheLineOnly) {
  const std::vector<CurvePoint> points{{0, 1.55e-6, 0}, {45, 1.4e-6, 1e-8}, {270, 0.4e-6, 1e-8}};
  const Figures figures = draw_figures(analysed(identify_table(points, {})), {}, folder.path());
  EXPECT_EQ(figures.skipped, "");
  EXPECT_EQ(figures.drawn.size(), 1u);
}

TEST_F(Figure, OfABadScriptIsNoneAndAReason) {
  std::ofstream(folder.path() / "bad.gp") << "plot nonsense(((\n";
  EXPECT_THAT(draw(folder.path() / "bad.gp", folder.path() / "bad.svg"), HasSubstr("bad.gp"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "bad.svg"));
}

TEST(ThrustShares, AreInPercentOfTheThrustWithoutOcclusion) {
  const CampaignTruth truth;
  const Identification fit = identify(campaign_steps(truth));
  const auto shares = shares_of_steps(fit);
  ASSERT_EQ(shares.size(), 5u);
  for (const ThrustShares& entry : shares) {
    ASSERT_EQ(entry.percent.size(), 3u) << "one per repetition";
    EXPECT_NEAR(entry.percent[0], 100 * truth.k(entry.phi_deg) / truth.K_T, 1);
  }
}

Analysis analysis() { return analyse(identify(campaign_steps())); }

TEST(AnalysisSections, ShowEveryRowOfTheBudgetAndWhatIsAssumed) {
  const Analysis found = analysis();
  const std::string html = analysis_sections(found);
  (void)parsed("<div>" + html + "</div>");
  for (const BudgetRow& row : found.coefficients.front().rows) expect_words(html, {">" + typeset(row.source) + "<"});
  EXPECT_THAT(html, HasSubstr("assumed: slopes of loading and unloading")) << "nobody gave the calibration of the cell";
  expect_words(html, {"Uncertainty budget", "combined u"});
}

TEST(AnalysisSections, TellHowSureStandardAirIsWhereTheAirIsKnown) {
  AnalysisOptions options;
  EXPECT_THAT(analysis_sections(analyse(identify(campaign_steps()), options)), Not(HasSubstr("in standard air, 95 %")));
  options.bench.air_density = 0.002;
  auto steps = campaign_steps();
  for (auto& step : steps) step.air_density_kg_m3 = 1.18;
  const std::string html = analysis_sections(analyse(identify(steps), options));
  (void)parsed("<div>" + html + "</div>");
  EXPECT_THAT(html, HasSubstr("in standard air, 95 %"));
}

TEST(AnalysisSections, ShowTestsWithTheirP_AndLeaveTheVerdictToTheTopOfThePage) {
  Analysis found = analysis();
  found.curvature.lack_of_fit = {"line <bent>", "k is a line", "F", 99, 2, 10, 1e-7};
  const std::string html = analysis_appendix(found);
  (void)parsed("<div>" + html + "</div>");
  expect_words(html, {"line &lt;bent&gt;", "&lt; 0.0001", "a gain of the load cell is in ± as its calibration"});
  EXPECT_THAT(html, Not(HasSubstr("rejected")));
}

TEST(AnalysisSections, LeaveOutWhatIsNotThere) {
  EXPECT_THAT(analysis_sections({}), Not(HasSubstr("<h2>")));
  EXPECT_EQ(claims_section({}), "");
}

TEST(AnalysisSections, ListClaimsWithIntervalAndVerdict) {
  const std::vector<Claim> claims{{"a", "slopes <equal>", "1", 1.02, 0.98, 1.06, 0.9, 1.1, Verdict::holds},
                                  {"b", "not here", "1"}};
  const std::string html = claims_section(claims);
  (void)parsed("<div>" + html + "</div>");
  expect_words(html, {"<td>1.02</td><td>0.98 to 1.06</td><td>0.9 to 1.1</td>", "slopes &lt;equal&gt;", "not tested"});
}

/// The set of signals that a program started as gnuplot is ignores, a bit each from signal 1 on.
std::uint64_t ignored_by_a_child(const std::filesystem::path& folder) {
  const auto program = folder / "program.sh";
  std::ofstream(program) << "#!/bin/sh\nexec grep SigIgn: /proc/self/status\n";
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  std::ofstream(folder / "script.gp") << "\n";
  EXPECT_EQ(draw(folder / "script.gp", folder / "figure.svg", program.string()), "");
  std::string name, mask = "0";
  std::ifstream(folder / "figure.svg") >> name >> mask;
  return std::stoull(mask, nullptr, 16);
}

TEST(Gnuplot, IgnoresNoSignalThatThisProgramIgnores) {
  const test::TemporaryFolder folder;
  for (const int number : {SIGPIPE, SIGXFSZ}) {
    const auto before = ::signal(number, SIG_IGN);
    EXPECT_EQ(ignored_by_a_child(folder.path()) >> (number - 1) & 1, 0u) << number;
    ::signal(number, before);
  }
}

}  // namespace report_test
}  // namespace kphi::fit
