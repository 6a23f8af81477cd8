#include "results/reduction/weighing.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <random>

#include "base/error.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::results {
namespace weighing_test {

using testing::HasSubstr;

/// Of a cell that is what it should be, but for what is given.
struct Cell {
  double gain = 1, hysteresis = 0, drift_n_per_s = 0, noise_n = 0;
  int sign = 1;
};

Weighing weighed(const Cell& cell, int times = 3, std::uint32_t seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  Weighing weighing;
  weighing.bench = "lab";
  weighing.weighed_utc = "2026-07-04T09:30:00Z";
  weighing.cell_serial = "FT12345";
  weighing.mass_kg = 0.5;
  weighing.mass_u_kg = 1e-6;
  weighing.gravity_u_m_s2 = 1e-5;
  const double force = cell.sign * cell.gain * weighing.force_n();
  for (int i = 0; i <= 2 * times; ++i) {
    Weighing::Level level;
    level.loaded = i % 2 == 1;
    level.time_s = 10.0 * i;
    level.seconds = 3;
    level.mean[2] = 1.5 + cell.drift_n_per_s * level.time_s + cell.noise_n * noise(random);
    if (level.loaded) level.mean[2] += force;
    if (!level.loaded && i > 0) level.mean[2] += cell.hysteresis * force;
    level.mean[0] = level.loaded ? 0.004 * force : 0;
    level.mean[3] = level.loaded ? 0.002 * force : 0;
    level.u.fill(cell.noise_n);
    weighing.levels.push_back(level);
  }
  return weighing;
}

TEST(Weighing, KnowsTheForceOfAWeightInAir) { EXPECT_NEAR(weighed({}).force_n(), 0.5 * 9.80665 * (1 - 0.00015), 1e-9); }

TEST(Weighing, TellsTheGainWhateverZeroAndDriftAre) {
  const CellCheck check = check_of(weighed({.gain = 1.01, .drift_n_per_s = 0.003}));
  EXPECT_NEAR(check.gain.value, 1.01, 1e-9);
  EXPECT_LT(check.gain.expanded(), 0.02);
  EXPECT_EQ(check.sign, 1);
}

TEST(Weighing, TakesAPullAgainstTheAxisForOne) {
  const CellCheck check = check_of(weighed({.gain = 0.98, .sign = -1}));
  EXPECT_NEAR(check.gain.value, 0.98, 1e-9);
  EXPECT_EQ(check.sign, -1);
}

TEST(Weighing, TellsCrossTalkAndTheTiltThatWouldMakeIt) {
  const CellCheck check = check_of(weighed({}));
  EXPECT_NEAR(check.crosstalk[0].value, 0.004, 1e-9);
  EXPECT_NEAR(check.crosstalk[3].value, 0.002, 1e-9) << "m";
  EXPECT_EQ(check.crosstalk[2].value, 0) << "its own";
  EXPECT_NEAR(check.tilt_rad, 0.004, 1e-5);
}

TEST(Weighing, TellsWhatStaysOfALoadAndDoubtsTheGainByIt) {
  const CellCheck check = check_of(weighed({.gain = 1.01, .hysteresis = 0.002}));
  EXPECT_NEAR(check.hysteresis.value, 0.002, 2e-5);
  EXPECT_LT(std::abs(check.gain.value - 1.01), check.gain.expanded());
}

TEST(Weighing, CountsAGainThatIsNotCorrectedAsUncertainty) {
  const CellCheck check = check_of(weighed({.gain = 1.01}));
  EXPECT_NEAR(check.u_calibration(), 0.01, 1e-5);
}

TEST(Weighing, CoversTheTrueGainInNineteenOfTwentyTrials) {
  int covered = 0;
  for (std::uint32_t seed = 1; seed <= 2000; ++seed) {
    const CellCheck check = check_of(weighed({.gain = 1.005, .noise_n = 0.004}, 3, seed));
    if (std::abs(check.gain.value - 1.005) <= check.gain.expanded()) ++covered;
  }
  EXPECT_GE(covered, 1900);
}

TEST(Weighing, SaysWhatItFound) {
  const Weighing weighing = weighed({.gain = 0.99, .noise_n = 0.001});
  EXPECT_THAT(gain_words(weighing, check_of(weighing)),
              testing::MatchesRegex("reads 1\\.0[0-9]+ ± 0\\.[0-9]+ % too little along z"));
}

TEST(Weighing, SaysThatAGainIsRightWhereItsUncertaintyHoldsOne) {
  const Weighing weighing = weighed({.noise_n = 0.001});
  EXPECT_THAT(gain_words(weighing, check_of(weighing)),
              testing::MatchesRegex("reads right within 0\\.[0-9]+ % along z"));
}

TEST(Weighing, IsReadBackAsItWasWritten) {
  const Weighing weighing = weighed({.noise_n = 0.001});
  const Weighing read = parse_weighing(format_weighing(weighing), "w.json");
  EXPECT_EQ(format_weighing(read), format_weighing(weighing));
  EXPECT_EQ(read.levels.size(), 7u);
}

TEST(Weighing, RefusesAFileThatIsNone) {
  const std::string good = format_weighing(weighed({}));
  const auto refused = [](const std::string& text) {
    try {
      (void)parse_weighing(text, "w.json");
      return std::string();
    } catch (const ConfigurationError& error) {
      return std::string(error.what());
    }
  };
  EXPECT_THAT(refused("{}"), HasSubstr("w.json: not a weighing of kphi weigh"));
  EXPECT_THAT(refused(good.substr(0, good.size() / 2)), HasSubstr("w.json: not a weighing"));
  std::string other = good;
  other.replace(other.find("\"z\""), 3, "\"q\"");
  EXPECT_THAT(refused(other), HasSubstr("axis is q"));
  std::mt19937 random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    std::string damaged = good;
    for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] = static_cast<char>(random());
    (void)refused(damaged);  // never anything but a ConfigurationError
  }
}

TEST(NearestWeighing, IsTheNewestOfThatBenchAndAxisBeforeTheCampaign) {
  const test::TemporaryFolder folder;
  const auto write = [&](const char* name, const char* bench, const char* utc) {
    Weighing weighing = weighed({});
    weighing.bench = bench;
    weighing.weighed_utc = utc;
    std::ofstream(folder.path() / name) << format_weighing(weighing);
  };
  const auto found = [&](const char* utc, int axis = 2) {
    const auto weighing = nearest_weighing(
        folder.path(), [&](const Weighing& one) { return one.bench == "lab" && one.axis == axis; }, utc);
    return weighing ? weighing->weighed_utc : std::string("none");
  };
  EXPECT_EQ(found("2026-07-05T00:00:00Z"), "none");
  write("1_weigh.json", "lab", "2026-07-01T00:00:00Z");
  write("2_weigh.json", "lab", "2026-07-03T00:00:00Z");
  write("3_weigh.json", "lab", "2026-07-09T00:00:00Z");
  write("4_weigh.json", "other", "2026-07-04T00:00:00Z");
  EXPECT_EQ(found("2026-07-05T00:00:00Z"), "2026-07-03T00:00:00Z");
  EXPECT_EQ(found("2026-06-05T00:00:00Z"), "2026-07-01T00:00:00Z") << "else the first one after it";
  EXPECT_EQ(found("2026-07-05T00:00:00Z", 0), "none");
  EXPECT_EQ(nearest_weighing(
                folder.path() / "no", [](const Weighing&) { return true; }, ""),
            std::nullopt)
      << "no such folder";
}

}  // namespace weighing_test
}  // namespace kphi::results
