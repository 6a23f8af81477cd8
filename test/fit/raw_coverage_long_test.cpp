// The statement about intervals through raw samples: campaigns on the deterministic bench, each on a stand, a cell and
// a motor of its own, through recording, reduction and fit. KPHI_CAMPAIGNS: of each stand.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <string>

#include "base/error.hpp"
#include "daq/campaign/campaign_run.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "drivers/sim/physics/truth.hpp"
#include "results/steps_csv.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/fit/zero_study.hpp"

namespace kphi::fit {
namespace raw_coverage_long_test {

struct RawStand {
  const char* name;
  const char* scatter;         ///< as a bench file writes it
  double rise_per_krad_s = 0;  ///< as in it
};

const RawStand kStands[]{
    {"Mounting", "mounting: 0.005"},
    {"CellGain", "mounting: 0.002, cell_gain_scatter: 0.0064"},
    {"Clock", "mounting: 0.002, clock_scatter: 0.002"},
    {"ZeroWalks", "mounting: 0.002, zero_walk_n: 0.03"},
    {"SlowNoise", "mounting: 0.002, slow_noise_n: 0.02"},
    {"AsShipped",
     "mounting: 0.005, cell_gain_scatter: 0.0064, clock_scatter: 0.002, zero_walk_n: 0.003, slow_noise_n: 0.001"},
    {"Rough",
     "mounting: 0.01, cell_gain_scatter: 0.0064, clock_scatter: 0.002, zero_walk_n: 0.01, slow_noise_n: 0.003"},
    {"RisesWithSpeed", "mounting: 0.002, rise_per_krad_s: 0.05", 0.05}};

std::vector<results::StepMean> record(const RawStand& stand, unsigned seed) {
  const test::TemporaryFolder folder;
  const profiles::BenchConfig config = profiles::parse_bench(
      fmt::format(
          "format: kphi-bench/1\nname: test\n"
          "netbox: {{host: 127.0.0.1, rdt_port: 49152, http_port: 8049, rate_hz: 7000, records_per_datagram: 40}}\n"
          "iq: {{device: /dev/null, baud: 921600, module_id: 0, spin: +1, telemetry_hz: 50, speed_max_rpm: 19300}}\n"
          "thrust_axis: \"+Fz\"\nsimulation: {{in_process: true, seed: {}, stand: {{{}}}}}\n",
          seed, stand.scatter),
      "bench.yaml");
  std::string text = test::short_campaign_text("0, 45, 90, 180, 270", 3, 12);
  text.insert(text.find("profile:"), "order: {remount_each_repetition: true}\n");
  daq::DeterministicBench bench(config, sim::BenchSettings{});
  const auto results = results::CampaignFolder::create(folder.path(), "20210530T000000Z", stand.name);
  daq::AutoConfirmOperator person;
  daq::Progress silence;
  (void)daq::run_campaign(bench, profiles::parse_campaign(text, "raw.yaml"), config, results, person, silence,
                          test::never);
  return results::read_steps(results.steps());
}

class RawCampaigns : public testing::TestWithParam<RawStand> {};

// A campaign that is refused tells no number, which is no
// wrong one; more than a few of them would be a poor program.
TEST_P(RawCampaigns, CoverTheTruth) {
  const char* const asked = std::getenv("KPHI_CAMPAIGNS");
  const unsigned campaigns = asked != nullptr ? static_cast<unsigned>(std::atoi(asked)) : 10;
  const RawStand& stand = GetParam();
  const sim::PropellerTruth& propeller = *sim::find_propeller("5x3");
  const auto truth = [&](double phi_deg) { return sim::thrust_coefficient(propeller, phi_deg); };
  std::map<std::string, Scatter> table;
  unsigned refused = 0;
  for (unsigned seed = 1; seed <= campaigns; ++seed) {
    try {
      Identification identification = identify(record(stand, seed));
      AnalysisOptions options;
      options.prediction_deg = {135};
      Analysis analysis = analyse(identification, options);
      const Fitted fitted{std::move(identification), std::move(analysis)};
      Scatter& number = table["number of the verdict"];
      const double error = true_error(fitted, [&](double phi_deg, double rpm) {
        return std::min(truth(0), truth(phi_deg)) * (1 + stand.rise_per_krad_s * (from_rpm(rpm).value() / 1000 - 1));
      });
      ++number.n;
      number.within += error <= fitted.analysis.flight.error.share ? 1 : 0;
      number.expanded += fitted.analysis.flight.error.share;
      if (stand.rise_per_krad_s > 0) continue;  // there is no single k
      for (std::size_t i = 0; i < fitted.identification.table.size(); ++i) {
        const Budget& k = fitted.analysis.coefficients[i];
        table[k.quantity].add(k, truth(fitted.identification.table[i].phi_deg));
      }
      const double slope = (truth(270) - truth(90)) / 180;
      table["intercept"].add(fitted.analysis.parameters[0], truth(90) - 90 * slope);
      table["slope"].add(fitted.analysis.parameters[1], slope);
      table["line at 135 deg"].add(fitted.analysis.predictions.front().k, truth(135));
    } catch (const FitError& why) {
      fmt::print("{} {}: refused: {}\n", stand.name, seed, why.what());
      ++refused;
    }
  }
  fmt::print("{}: {} of {} refused\n", stand.name, refused, campaigns);
  EXPECT_LE(refused, 2 + campaigns / 20);
  for (const auto& [quantity, found] : table) {
    fmt::print("  {:<24} {:5.1f} % of {}, +- {:.2g}\n", quantity, found.share(), found.n, found.expanded / found.n);
    const double spread = 3 * std::sqrt(0.95 * 0.05 / found.n);  // the least of 70 quantities
    EXPECT_GE(found.share(), 100 * (0.95 - spread)) << stand.name << ", " << quantity;
  }
}

INSTANTIATE_TEST_SUITE_P(Stands, RawCampaigns, testing::ValuesIn(kStands),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace raw_coverage_long_test
}  // namespace kphi::fit
