// What ± and the number of the verdict say, against campaigns through raw samples: the shipped campaign with fewer and
// shorter steps on stands that scatter each in its way. KPHI_CAMPAIGNS: of each stand, 10 otherwise.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "daq/campaign/campaign_run.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "drivers/sim/physics/truth.hpp"
#include "results/steps_csv.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/source_dir.hpp"

namespace kphi::fit {
namespace raw_coverage_long_test {

struct RawStand {
  const char* name = "";
  std::uint64_t number = 0;  ///< for seeds that no other stand has
  profiles::SimulatedStand stand{};

  /// As `kphi fit` is told by `--u`: what this stand is known to scatter by.
  [[nodiscard]] BenchUncertainty bench() const {
    BenchUncertainty known = BenchUncertainty::none();
    known.cell_calibration = stand.cell_gain_scatter;
    known.motor_clock = stand.clock_scatter;
    known.mounting.reset();
    return known;
  }
};

void PrintTo(const RawStand& stand, std::ostream* out) { *out << stand.name; }

const std::vector<RawStand> kStands{
    {"Mounting", 1, {.mounting = 0.005}},
    {"CellGain", 2, {.mounting = 0.001, .cell_gain_scatter = 0.0064}},
    {"Clock", 3, {.mounting = 0.001, .clock_scatter = 0.002}},
    {"ZeroWalks", 4, {.mounting = 0.001, .zero_walk_n = 0.03}},
    {"SlowNoise", 5, {.mounting = 0.001, .slow_noise_n = 0.02}},
    {"AsShipped",
     6,
     {.mounting = 0.005,
      .zero_walk_n = 0.003,
      .slow_noise_n = 0.001,
      .cell_gain_scatter = 0.0064,
      .clock_scatter = 0.002}},
    {"Rough", 7, {.mounting = 0.015, .zero_walk_n = 0.02, .slow_noise_n = 0.01, .cell_gain_scatter = 0.01}},
    {"RisesWithSpeed", 8, {.rise_per_krad_s = 0.08, .mounting = 0.003}}};

/// Eight steps of 0.8 s instead of 40 of 2 s.
const profiles::Campaign& shortened() {
  static const profiles::Campaign campaign = [] {
    std::string text = test::bytes_of(test::source_dir() + "/profiles/icra2021_5in_3blade.yaml");
    for (const auto& [from, to] :
         {std::pair<std::string, const char*>("repetitions: 3", "repetitions: 3\nrepetitions_extra_max: 0"),
          {"steps: 40", "steps: 8"},
          {"dwell_s: 2.0", "dwell_s: 0.8"},
          {"zero_s: 2.0", "zero_s: 1.0"},
          {"minimum_discard_s: 1.0", "minimum_discard_s: 0.4"}})
      text.replace(text.find(from), from.size(), to);
    return profiles::parse_campaign(text, "shortened");
  }();
  return campaign;
}

Fitted measured(const RawStand& stand, std::uint64_t seed) {
  const test::TemporaryFolder folder;
  profiles::BenchConfig config = test::deterministic_config(static_cast<int>(seed));
  config.simulation->stand = stand.stand;
  daq::DeterministicBench bench(config, sim::BenchSettings{});
  const auto results = results::CampaignFolder::create(folder.path(), "20210530T000000Z", "raw");
  daq::AutoConfirmOperator person;
  daq::Progress silence;
  (void)daq::run_campaign(bench, shortened(), config, results, person, silence, [] { return false; });
  Identification found = identify(results::read_steps(results.steps()));
  AnalysisOptions options;
  options.bench = stand.bench();
  Analysis analysis = analyse(found, options);
  return {std::move(found), std::move(analysis)};
}

class RawCampaigns : public testing::TestWithParam<RawStand> {};

TEST_P(RawCampaigns, AreCoveredByWhatIsSaidOfThem) {
  const char* const asked = std::getenv("KPHI_CAMPAIGNS");
  const unsigned campaigns = asked == nullptr ? 10 : static_cast<unsigned>(std::atoi(asked));
  const sim::PropellerTruth& propeller = *sim::find_propeller("5x3");
  const double rise = GetParam().stand.rise_per_krad_s;
  // k of a stand that rises with the speed belongs to one speed.
  const auto truth = [&](double phi_deg, double rad_s) {
    return sim::thrust_coefficient(propeller, phi_deg) * (1 + rise * (rad_s / 1000 - 1));
  };
  std::map<std::string, unsigned> covered;
  std::map<std::string, double> told;
  double sum = 0, squares = 0, largest = 0;
  for (unsigned i = 0; i < campaigns; ++i) {
    const std::uint64_t seed = 1 + i + 1000 * GetParam().number;
    const Fitted fitted = measured(GetParam(), seed);
    const auto& [found, analysis] = fitted;
    const double at = reference_speed(found);
    for (std::size_t row = 0; row < found.table.size(); ++row) {
      const Budget& k = analysis.coefficients[row];
      const double off = k.value - truth(found.table[row].phi_deg, at);
      covered[k.quantity] += std::abs(off) <= k.expanded() ? 1 : 0;
      told[k.quantity] += k.expanded() / k.value / campaigns;
    }
    const double off = analysis.coefficients.front().value / truth(0, at) - 1;
    sum += off;
    squares += off * off;
    const double error = true_error(fitted, [&](double phi, double rpm) {
      return std::min(truth(0, from_rpm(rpm).value()), truth(phi, from_rpm(rpm).value()));
    });
    covered["number of the verdict"] += error <= analysis.flight.error.share ? 1 : 0;
    told["number of the verdict"] += analysis.flight.error.share / campaigns;
    largest = std::max(largest, error);
  }
  const double n = campaigns, deviation = std::sqrt((squares - sum * sum / n) / (n - 1));
  fmt::print("{:<15}", GetParam().name);
  for (const auto& [quantity, times] : covered) {
    fmt::print(" {} {} of {} (± {:.2f} %)", quantity, times, campaigns, 100 * told[quantity]);
    EXPECT_GE(times, 0.95 * n - 2.6 * std::sqrt(0.0475 * n)) << quantity;
  }
  fmt::print("; K_T 1.96 x scatter {:.2f} %, largest error of the thrust {:.2f} %\n", 196 * deviation, 100 * largest);
}

INSTANTIATE_TEST_SUITE_P(Stands, RawCampaigns, testing::ValuesIn(kStands),
                         [](const auto& stand) { return std::string(stand.param.name); });

}  // namespace raw_coverage_long_test
}  // namespace kphi::fit
