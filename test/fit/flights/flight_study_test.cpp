// How often the intervals of fitted flights hold the truth, and how often a weak propeller and a difference from the
// bench are found.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "compensation/units.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/flights/flight_fit.hpp"
#include "fit/flights/flight_result.hpp"
#include "fit/flights/speed_check.hpp"
#include "fit/propellers/compare.hpp"
#include "test/fit/flights/flown_log.hpp"
#include "test/fit/flights/logged_vehicle.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace flight_study_test {

using flown_log::Kind;

struct Count {
  int all = 0, held = 0;
  double z = 0, squares = 0, u = 0;
  void add(const Estimate& found, double truth) {
    const double off = (found.value - truth) / found.u;
    ++all;
    held += std::abs(found.value - truth) <= expanded(found) ? 1 : 0;
    z += off;
    squares += off * off;
    u += found.u;
  }
  [[nodiscard]] double share() const { return static_cast<double>(held) / all; }
};

struct Study {
  std::map<std::string, Count> quantities;
  int flights = 0, refused = 0, right = 0, wrong = 0, told = 0;
};

/// As the program fits it: speeds by the vibration where it confirms them.
FlightFit fitted(flown_log::FlownLog flown, const LoggedVehicle& vehicle, std::optional<FlownBins>* bins = nullptr) {
  FlightPriors priors;
  correct_speeds(flown.log, check_speeds(flown.log, 4, 2), priors);
  const FlownBins cut = flown_bins(flown.log, vehicle);
  if (bins != nullptr) *bins = cut;
  return fit_flight(cut, vehicle, priors);
}

Study study(Kind kind, int flights, std::uint64_t first_seed, const flown_log::Settings& settings = {}) {
  Study all;
  LoggedVehicle vehicle = flown_log::logged_vehicle();
  for (int n = 0; n < flights; ++n) {
    const auto flown = flown_log::fly(kind, first_seed + static_cast<std::uint64_t>(n), settings);
    vehicle.mass_kg = flown.truth.told_kg;
    ++all.flights;
    try {
      const FlightFit fit = fitted(flown, vehicle);
      if (kind != Kind::wrong_mass) all.quantities["K_T"].add({fit.k_t, fit.k_t_u, fit.k_t_freedom}, flown.truth.k_t);
      if (!fit.alone()) {
        const double wide = from_degrees(fit.wide_deg()).value(), per = -1 / wide, sixty = 60 / fit.wide_deg();
        const Estimate r = fit.ratio();
        all.quantities["slope/K_T"].add({(1 - r.value) * per, r.u * std::abs(per), r.freedom}, -flown.truth.fall);
        all.quantities["k(60°)/K_T"].add({1 - (1 - r.value) * sixty, r.u * sixty, r.freedom},
                                         flown.truth.ratio(from_degrees(60).value()));
      }
      if (fit.lag_s) all.quantities["lag"].add(*fit.lag_s, flown.truth.lag_s);
      if (fit.law) all.quantities["law"].add(*fit.law, flown.truth.law);
      for (std::size_t i = 0; i < 4; ++i)  // beside the mean of the others, whose mean with it is 1
        all.quantities["rotors"].add(fit.rotors[i], 4.0 / 3 * (flown.truth.share[i] - 1));
      all.told += fit.rotors_told ? 1 : 0;
      if (fit.weak_rotor) ++(static_cast<int>(*fit.weak_rotor) == flown.truth.weak ? all.right : all.wrong);
    } catch (const FitError& error) {
      ++all.refused;
      std::printf("%s %d: %s\n", flown_log::name_of(kind), n, error.what());
    }
  }
  for (const auto& [name, one] : all.quantities)
    std::printf("%-12s %-11s %4d of %4d, %.3f; mean of off/u %+.2f, root mean square %.2f, mean u %.3g\n",
                flown_log::name_of(kind), name.c_str(), one.held, one.all, one.share(), one.z / one.all,
                std::sqrt(one.squares / one.all), one.u / one.all);
  std::printf("%-12s %d flights, %d refused; rotors told %d, weak one named right %d, wrong %d\n",
              flown_log::name_of(kind), all.flights, all.refused, all.told, all.right, all.wrong);
  return all;
}

/// Deviations of a share of 95 %.
double room(int n) { return std::sqrt(0.95 * 0.05 / n); }

TEST(ManyFlights, HoldTheTruthInNineteenOfTwenty) {
  std::map<std::string, Count> pooled;
  for (const Kind kind : flown_log::kKinds) {
    const Study found = study(kind, 12, 1000);
    EXPECT_EQ(found.refused, 0);
    for (const auto& [name, one] : found.quantities) {
      Count& to = pooled[name];
      to.all += one.all, to.held += one.held, to.z += one.z, to.squares += one.squares;
    }
    EXPECT_GE(found.right, kind == Kind::damaged ? 10 : 0);
    EXPECT_LE(found.wrong, kind == Kind::damaged ? 0 : 1);
  }
  for (const auto& [name, one] : pooled)
    EXPECT_GE(one.share(), 0.95 - 3.5 * room(name == "rotors" ? one.all / 3 : one.all)) << name;
}

TEST(HundredsOfFlights, HoldTheTruthInNineteenOfTwenty) {
  for (const Kind kind : flown_log::kKinds) {
    const Study found = study(kind, 200, 5000);
    EXPECT_EQ(found.refused, 0);
    for (const auto& [name, one] : found.quantities) {
      EXPECT_GE(one.share(), 0.93 - 2 * room(one.all)) << flown_log::name_of(kind) << " " << name;
      EXPECT_LT(std::abs(one.z / one.all), 0.25) << flown_log::name_of(kind) << " " << name;
    }
    EXPECT_GE(found.right, kind == Kind::damaged ? 180 : 0);
    EXPECT_LE(found.wrong, kind == Kind::damaged ? 0 : 10) << "propellers differ by 1 %, and few by 3 %";
  }
}

/// Coefficients as a file, read again as `kphi compare` does.
ComparedResult result_of(const Fitted& fitted, const std::string& flight, const test::TemporaryFolder& folder) {
  Provenance provenance;
  provenance.flight = flight;
  const std::string path = (folder / "k.yaml").string();
  std::ofstream(path) << format_coefficients(fitted, provenance);
  return load_result(path);
}

/// What a bench finds of the same propeller: k to half a percent each, `level` times as large, `less` of it kept at
/// 65°.
Fitted bench_of(const flown_log::Truth& truth, double level, double less, Random& random) {
  std::vector<CurvePoint> points;
  for (const double phi : {0.0, 30.0, 60.0, 90.0}) {
    const double kept = truth.ratio(from_degrees(phi).value()) * (1 - less * phi / 65);
    points.push_back({phi, level * truth.k_t * kept * (1 + 0.005 * random.normal()), 0.005 * truth.k_t});
  }
  Identification table = identify_table(points, {.curve = {.anchored = true}, .propeller = "5x3"});
  Analysis analysis = analyse(table);
  return {std::move(table), std::move(analysis)};
}

struct Verdicts {
  int flights = 0, differ = 0, of_level = 0,
      of_ratio = 0;  ///< called different: same propeller, 3 % more k, 3 % less kept
};

Verdicts against_benches(int flights, std::uint64_t first_seed, const flown_log::Settings& settings = {}) {
  const test::TemporaryFolder folder;
  LoggedVehicle vehicle = flown_log::logged_vehicle();
  Verdicts found;
  Random random(first_seed);
  for (int n = 0; n < flights; ++n) {
    const auto flown = flown_log::fly(Kind::arms_moving, first_seed + static_cast<std::uint64_t>(n), settings);
    vehicle.mass_kg = flown.truth.told_kg;
    const FlownBins bins = flown_bins(flown.log, vehicle);
    FlightPriors priors;
    priors.scale_u = settings.scale_u, priors.bias_u = settings.bias_u;
    const FlightFit fit = fit_flight(bins, vehicle, priors);
    const ComparedResult flight =
        result_of(fitted_of(fit, bins, vehicle, {}, {.propeller = "5x3"}), "a flight", folder);
    const auto differs = [&](double level, double less) {
      const Comparison both = compare(result_of(bench_of(flown.truth, level, less, random), "", folder), flight);
      return both.verdict == Agreement::differ ? 1 : 0;
    };
    ++found.flights;
    found.differ += differs(1, 0);
    found.of_level += differs(1.03, 0);
    found.of_ratio += differs(1, 0.03);
  }
  std::printf(
      "bench against flight: %d of %d called different; %d where K_T differs by 3 %%, %d where k(65°)/K_T does\n",
      found.differ, found.flights, found.of_level, found.of_ratio);
  return found;
}

TEST(ManyFlights, AgreeWithTheirBenchAndNotWithAnother) {
  const Verdicts found = against_benches(40, 3000);
  EXPECT_LE(found.differ, 6) << "5 %, and three deviations";
  EXPECT_GE(found.of_ratio, 36);
  EXPECT_GE(found.of_level, 26) << "mass and accelerometer to 0.8 %: four of five";
}

TEST(HundredsOfFlights, AgreeWithTheirBenchAndNotWithAnother) {
  const Verdicts found = against_benches(200, 9000);
  EXPECT_LE(found.differ, 16);
  EXPECT_GE(found.of_ratio, 180);
  EXPECT_GE(found.of_level, 130);
}

/// Laid on six sides before the flight: `--u scale=0.002 --u bias=0.02`.
constexpr flown_log::Settings kCalibrated{.scale_u = 0.002, .bias_u = 0.02};

TEST(HundredsOfFlights, OfACalibratedAccelerometerFindThreePercentOfKTToo) {
  const Verdicts found = against_benches(200, 12000, kCalibrated);
  EXPECT_LE(found.differ, 16);
  EXPECT_GE(found.of_ratio, 180);
  EXPECT_GE(found.of_level, 180);
}

}  // namespace flight_study_test
}  // namespace kphi::fit
