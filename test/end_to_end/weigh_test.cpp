// `kphi weigh`: at a terminal on a bench over its true transports, and what `kphi fit` makes of it.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include "test/end_to_end/running_bench.hpp"
#include "test/end_to_end/terminal.hpp"

namespace kphi::test::weigh_test {

using testing::HasSubstr;
using testing::Not;

std::string bench_of(double gain) {
  std::string bench = deterministic_config(5).text;
  bench.insert(bench.find(", seed: 5"), fmt::format(", stand: {{cell_gain: {}}}", gain));
  return bench;
}

std::vector<std::string> weigh(const std::string& bench, const std::string& out) {
  return {kphi(), "weigh", "--bench", bench, "--kg", "0.5", "--g", "9.8066", "--out", out};
}

/// How often for the mass, off or on.
int asked(const std::string& words) {
  int questions = 0;
  for (std::size_t at = 0; (at = words.find("then press Enter", at)) != std::string::npos; ++at) ++questions;
  return questions;
}

/// Each answer is followed by a measurement, and that by the next question or the result.
bool answered(const std::string& words, int question) {
  return asked(words) > question || words.find("gain ") != std::string::npos;
}

TEST(Weigh, AsksAtATerminalWithoutPowerAndKeepsWhatItFound) {
  RunningBench bench(Manner{.time_scale = 4, .supply = true});
  Terminal terminal;
  Process process(joined(weigh(bench.path("bench.yaml"), bench.path("results")), {"--json"}), {},
                  {{}, terminal.descriptor(), 0});
  for (int question = 1; question <= 7; ++question) {
    while (asked(process.err()) < question) ASSERT_TRUE(process.hear(std::chrono::seconds(60))) << process.err();
    EXPECT_EQ(bench.status()["supply"]["output"], false);
    // What is pressed in the moment in which the question appears may not count yet.
    while (!answered(process.err(), question)) {
      terminal.press("\n");
      ASSERT_TRUE(process.hear(std::chrono::milliseconds(200))) << process.err();
    }
  }
  EXPECT_EQ(process.wait(), 0) << process.err();
  const auto found = nlohmann::json::parse(process.out());
  EXPECT_NEAR(found["gain"]["value"].get<double>(), 1, found["gain"]["expanded_95"].get<double>());
  EXPECT_NE(bytes_of(found["file"].get<std::string>()), "");
  EXPECT_TRUE(bench.account().ends_without_power());
}

TEST(Weigh, StopsAtAnyOtherKeyWithoutAFile) {
  RunningBench bench(Manner{.time_scale = 4, .supply = true});
  Terminal terminal;
  Process process(weigh(bench.path("bench.yaml"), bench.path("results")), {}, {{}, terminal.descriptor(), 0});
  process.wait_for("Take everything off");
  while (process.hear(std::chrono::milliseconds(200))) terminal.press("x");
  EXPECT_EQ(process.wait(), 130) << process.err();
  EXPECT_FALSE(std::filesystem::exists(bench.path("results")));
  EXPECT_TRUE(bench.account().ends_without_power());
}

TEST(Weigh, NeedsSomebodyWhoHangsTheMassOn) {
  const VirtualCampaign here(short_campaign_text());
  EXPECT_THAT(ran(weigh(here.path("bench.yaml"), here.path("out")), 2).err,
              HasSubstr("nobody can say that the mass is on"));
}

TEST(Weigh, IsTakenUpByFitForCampaignsOfItsBenchInItsFolder) {
  const VirtualCampaign here(short_campaign_text("0, 90, 180"), bench_of(1.01));
  (void)ran(joined(weigh(here.path("bench.yaml"), here.path("out")), {"--yes"}));
  const std::string folder = ran(here.command()).folder();
  const auto fit = ran({kphi(), "fit", "--accept", folder});
  EXPECT_THAT(fit.err, HasSubstr("calibration   weighed with 0.5 kg on 2021-05-30: reads "));
  EXPECT_THAT(fit.err, HasSubstr("% too much along z; in the ±, not corrected"));
  EXPECT_THAT(fit.out, Not(HasSubstr("not in it: repetitions, cell calibration")));
  const std::string file = bytes_of(std::filesystem::path(folder) / "coefficients.yaml");
  EXPECT_THAT(file, HasSubstr("cell_weighed: \"weighed with 0.5 kg on 2021-05-30: reads "));
  EXPECT_NEAR(YAML::Load(file)["provenance"]["fit"]["u"]["calibration"].as<double>(), 0.01, 0.001);
  EXPECT_THAT(bytes_of(std::filesystem::path(folder) / "report.html"), HasSubstr("weighed with 0.5 kg on 2021-05-30"));
  const auto given = ran({kphi(), "fit", "--accept", folder, "--u", "calibration=0.002"});
  EXPECT_THAT(given.err, Not(HasSubstr("weighed"))) << "what a person says comes first";
}

TEST(Weigh, NeverReplacesAnEarlierRecord) {
  const VirtualCampaign here(short_campaign_text());
  const auto again = joined(weigh(here.path("bench.yaml"), here.path("out")), {"--yes"});
  const std::string first = ran(again).out, second = ran(again).out;  // both of the same bench time
  EXPECT_NE(first, second);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(here.path("out")), {}), 2);
}

TEST(Weigh, OfAnotherBenchOrCellIsNotTakenUp) {
  const VirtualCampaign here(short_campaign_text("0, 90, 180"), bench_of(1.01));
  (void)ran(joined(weigh(here.path("bench.yaml"), here.path("out")), {"--yes"}));
  std::filesystem::path kept;
  for (const auto& entry : std::filesystem::directory_iterator(here.path("out"))) kept = entry.path();
  const std::string text = bytes_of(kept);
  const std::string folder = ran(here.command()).folder();
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    write(kept, other.replace(other.find(from), from.size(), to));
    return ran({kphi(), "fit", "--accept", "--no-report", folder}).err;
  };
  EXPECT_THAT(changed("\"bench\": \"test\"", "\"bench\": \"another\""), Not(HasSubstr("weighed")));
  for (const char* serial : {"FT99999", "21001", "1", "", "FT21001x"})
    EXPECT_THAT(
        changed("\"FT21001\"", fmt::format("\"{}\"", serial)),
        HasSubstr(fmt::format("was cell {}, simulated, the campaign has another (FT21001): not taken", serial)));
  EXPECT_THAT(changed("\"simulated\"", "\"measured\""), HasSubstr("was cell FT21001, measured, the campaign has"));
  EXPECT_THAT(changed("FT21001", "FT21001"), HasSubstr("weighed with")) << "and not: not taken";
}

}  // namespace kphi::test::weigh_test
