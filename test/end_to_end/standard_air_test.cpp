// One simulated propeller in thin and in dense air, each through campaign, recording, reduction and identification: the
// coefficients differ as the air does, those in standard air not at all.

#include "daq/campaign/campaign_run.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "drivers/ambient/air.hpp"
#include "fit/model/identification.hpp"
#include "results/campaign_folder.hpp"
#include "results/steps_csv.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/profiles/refusals.hpp"

namespace kphi::test::standard_air_test {

/// Pa, at 20 °C and half the humidity that the air can hold.
double pressure_of(double kg_m3) {
  double low = ambient::kLowestPressure, high = ambient::kHighestPressure;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (ambient::density_of({20, middle, 0.5, 0.1, 10, 0.01}).kg_m3 < kg_m3 ? low : high) = middle;
  }
  return low;
}

/// Nothing but the air disturbs this bench, beyond last digits: a force or a speed that never moves is called frozen.
sim::BenchSettings quiet() {
  sim::BenchSettings settings;
  settings.module.sensors.perfect = true;
  settings.plant.motor.turbulence = 1e-4;
  auto& cell = settings.plant.load_cell;
  cell.zero_spread = cell.drift_per_minute = cell.walk_per_root_minute = {};
  cell.noise = {0, 0, 4e-6, 0, 0, 0};
  cell.once_per_turn = cell.blade_pass = cell.blade_pass_occluded = 0;
  return settings;
}

profiles::BenchConfig place_in(double kg_m3) {
  const std::string text =
      profiles::changed(deterministic_config(5).text, "seed: 5", fmt::format("seed: 5, air_density_kg_m3: {}", kg_m3));
  const std::string air = fmt::format(
      "ambient: {{manual: {{temperature_c: 20, pressure_pa: {}, relative_humidity: 0.5, u_temperature_c: 0.1, "
      "u_pressure_pa: 10, u_relative_humidity: 0.01}}}}\n",
      pressure_of(kg_m3));
  return profiles::parse_bench(text + air, "bench.yaml");
}

profiles::Campaign patient_campaign() {
  const std::string text = profiles::changed(short_campaign_text("0, 90, 180", 1, 3), "dwell_s: 0.6", "dwell_s: 2.5");
  return profiles::parse_campaign(profiles::changed(text, "minimum_discard_s: 0.3", "minimum_discard_s: 2"),
                                  "patient.yaml");
}

fit::Identification identified_in(double kg_m3) {
  const TemporaryFolder folder;
  const profiles::BenchConfig config = place_in(kg_m3);
  const profiles::Campaign campaign = patient_campaign();
  daq::DeterministicBench bench(config, quiet());
  const auto results = results::CampaignFolder::create(folder.path(), "u", "c");
  daq::AutoConfirmOperator person;
  daq::Progress silence;
  (void)daq::run_campaign(bench, campaign, config, results, person, silence, [] { return false; });
  return fit::identify(results::read_steps(results.steps()));
}

TEST(StandardAir, GivesTheSamePropellerTheSameCoefficientsInAnyAir) {
  const fit::Identification thin = identified_in(1.10), dense = identified_in(1.25);
  ASSERT_TRUE(thin.air && dense.air);
  EXPECT_NEAR(thin.air->value, 1.10, 1e-9);
  EXPECT_NEAR(dense.air->value, 1.25, 1e-9);
  ASSERT_EQ(thin.table.size(), 3u);
  for (std::size_t i = 0; i < thin.table.size(); ++i) {
    EXPECT_NEAR(dense.table[i].k / thin.table[i].k, 1.25 / 1.10, 1e-6);
    ASSERT_TRUE(thin.table[i].air && dense.table[i].air);
    EXPECT_NEAR(dense.table[i].k / dense.table[i].air->value / (thin.table[i].k / thin.table[i].air->value), 1, 1e-6)
        << thin.table[i].phi_deg << "°";
  }
}

}  // namespace kphi::test::standard_air_test
