// A campaign on the deterministic bench, through the program, twice: the ground on which fault tests stand.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <random>
#include <tuple>

#include "results/steps_csv.hpp"
#include "test/end_to_end/program.hpp"
#include "test/results/recordings.hpp"

namespace kphi::test::deterministic_campaign_test {

using testing::HasSubstr;

/// Every file below a folder: relative name → bytes.
std::map<std::string, std::string> contents(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[std::filesystem::relative(entry.path(), folder)] = bytes_of(entry.path());
  }
  return files;
}

std::map<std::string, std::string> campaign_on(const std::string& bench, const std::string& campaign) {
  const VirtualCampaign here(campaign, bench);
  (void)ran({kphi(), "fit", "--accept", ran(here.command()).folder()});
  return contents(here.path("out"));
}

std::map<std::string, std::string> campaign_from(int seed) {
  return campaign_on(deterministic_config(seed).text, short_campaign_text("0, 90, 180", 2));
}

const std::string& file_named(const std::map<std::string, std::string>& files, const std::string& ending) {
  for (const auto& [name, bytes] : files) {
    if (name.ends_with(ending)) return bytes;
  }
  static const std::string none;
  return none;
}

TEST(DeterministicCampaign, GivesTheSameFilesByteForByteFromOneSeedAndOthersFromAnother) {
  const auto once = campaign_from(5);
  const auto again = campaign_from(5);
  ASSERT_GE(once.size(), 10u);
  for (const auto& [name, bytes] : once) {
    ASSERT_TRUE(again.count(name)) << name;
    EXPECT_TRUE(again.at(name) == bytes) << name << " differs";
  }
  EXPECT_EQ(once.size(), again.size());
  const auto other = campaign_from(6);
  for (const auto& [name, bytes] : once) {
    if (name.ends_with(".h5") || name.ends_with("steps.csv") || name.ends_with("means.csv") ||
        name.ends_with("coefficients.yaml")) {
      EXPECT_FALSE(other.at(name) == bytes) << name << " does not depend on the seed";
    }
  }
}

TEST(DeterministicCampaign, TellsInTheReportWhetherTheMotorsClockWasCheckedAndCorrectsByIt) {
  const std::string campaign = short_campaign_text("0, 90, 180", 1);
  const std::string unchecked_bench = deterministic_config(7).text;
  std::string checked_bench = unchecked_bench;
  const std::string last_key = "speed_max_rpm: 19300";
  checked_bench.replace(checked_bench.find(last_key), last_key.size(),
                        last_key + ", clock_gain: {factor: 1.004, u: 2e-5}");
  const auto unchecked = campaign_on(unchecked_bench, campaign);
  const auto checked = campaign_on(checked_bench, campaign);

  EXPECT_THAT(file_named(unchecked, "report.html"), HasSubstr("<dt>Motor's clock</dt><dd>unchecked: all speeds"));
  EXPECT_THAT(file_named(unchecked, "coefficients.yaml"), HasSubstr("motor_clock: unchecked"));
  EXPECT_THAT(file_named(checked, "report.html"), HasSubstr("gain 1.004 ± 2.0e-05, speeds are corrected"));
  EXPECT_THAT(file_named(checked, "coefficients.yaml"), HasSubstr("motor_clock: {gain: 1.004, u: 2e-05}"));

  const auto K_T = [](const std::string& text) { return YAML::Load(text)["K_T"]["value"].as<double>(); };
  EXPECT_NEAR(K_T(file_named(checked, "coefficients.yaml")),
              K_T(file_named(unchecked, "coefficients.yaml")) / (1.004 * 1.004), 1e-4 * 1.5e-6);
}

TEST(DeterministicCampaign, APlateMountedOnceScattersOnceAndARemountedOneWithEachRun) {
  std::string bench = deterministic_config(5).text;
  bench.insert(bench.find(", seed: 5"), ", stand: {mounting: 0.03}");
  const auto spread = [&](const char* order) {
    const auto files = campaign_on(bench, short_campaign_text("0, 90, 180", 3) + order);
    std::map<int, double> k;  // by repetition, of its last step
    for (const auto& step : results::parse_steps(file_named(files, "steps.csv"), "steps.csv"))
      if (step.occlusion_deg == 90) k[step.repetition] = step.thrust_n / (step.speed_rad_s * step.speed_rad_s);
    EXPECT_EQ(k.size(), 3u);
    const auto [least, most] = std::minmax({k[1], k[2], k[3]});
    return most / least - 1;
  };
  EXPECT_LT(spread(""), 0.005);
  EXPECT_GT(spread("order: {remount_each_repetition: true}\n"), 0.01);
}

TEST(DeterministicCampaign, NoChangedBitOfAFittedFolderPassesUnnoticed) {
  const VirtualCampaign here(short_campaign_text("0, 45, 90, 180", 1), deterministic_config(5).text);
  const std::string folder = ran(here.command()).folder();
  constexpr const char* kChanged = "SHA-256 does not match the journal";
  const std::string fitted = ran({kphi(), "fit", folder}).out, replayed = ran({kphi(), "replay", folder}).out;
  (void)ran({kphi(), "verify", folder});
  std::mt19937_64 random(1);
  for (const auto& [name, whole] : contents(folder)) {
    const std::filesystem::path file = std::filesystem::path(folder) / name;
    results::test::make_writable(file);
    const std::string of_run = name.ends_with(".h5") ? ran({kphi(), "replay", file}).out : "";
    for (int place = 0; place < 3; ++place) {
      std::string bytes = whole;
      bytes[random() % bytes.size()] ^= static_cast<char>(1 << random() % 8);
      std::ofstream(file, std::ios::binary) << bytes;
      SCOPED_TRACE(name);
      (void)ran({kphi(), "verify", folder}, 5);
      if (!name.ends_with(".h5")) continue;
      EXPECT_THAT(ran({kphi(), "export", file, "--to", "csv"}, 5).err, HasSubstr(kChanged));
      // These do not read all of it: refused, or without any influence.
      for (const auto& [verb, path, unchanged] :
           {std::tuple{"replay", folder, replayed}, {"replay", file.string(), of_run}, {"fit", folder, fitted}}) {
        Process process({kphi(), verb, path});
        const int code = process.wait();
        EXPECT_TRUE(code == 5 || code == 0) << verb << ": " << code;
        if (code == 0) {
          EXPECT_EQ(process.out(), unchanged) << verb;
        } else {
          EXPECT_THAT(process.err(), HasSubstr(kChanged)) << verb;
        }
      }
    }
    std::ofstream(file, std::ios::binary) << whole;
  }
  EXPECT_THAT(ran({kphi(), "verify", folder}).out, HasSubstr("intact"));
}

TEST(DeterministicCampaign, StopsWithExitCodeFourWhenItsFaultScriptTakesTheStreamAway) {
  const VirtualCampaign here(short_campaign_text("0, 90, 180", 2),
                             deterministic_config(5, "faults.yaml").text);  // beside the bench file
  here.write("faults.yaml", "format: kphi-faults/1\nfaults:\n  - {at_s: 8, kind: taken_over}\n");
  EXPECT_THAT(ran(here.command(), 4).err,
              testing::AllOf(HasSubstr("another client has taken the stream"), HasSubstr("1 of 6 runs finished")));
}

}  // namespace kphi::test::deterministic_campaign_test
