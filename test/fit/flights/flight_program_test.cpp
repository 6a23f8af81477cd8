// A flight as a person hands it to kphi: fitted, compared with a bench, flown again.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "compensation/file/coefficient_file.hpp"
#include "test/end_to_end/process.hpp"
#include "test/fit/flights/flown_log.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace flight_program_test {

using flown_log::FlownLog;
using flown_log::Kind;
using test::Process;
using ::testing::AllOf;
using ::testing::HasSubstr;

struct Answer {
  int code = -1;
  std::string out, err;
};

/// Straight between the samples, held at the ends.
double at(const FlightChannel& channel, double time) {
  const auto next = std::ranges::upper_bound(channel.time_s, time) - channel.time_s.begin();
  const auto last = static_cast<std::ptrdiff_t>(channel.time_s.size()) - 1;
  if (next == 0) return channel.values.front();
  if (next > last) return channel.values.back();
  const auto b = static_cast<std::size_t>(next), a = b - 1;
  const double share = (time - channel.time_s[a]) / (channel.time_s[b] - channel.time_s[a]);
  return channel.values[a] + share * (channel.values[b] - channel.values[a]);
}

class FlightProgram : public ::testing::Test {
 protected:
  /// A table of 100 Hz and its layout.
  void write(const FlownLog& flown) {
    const FlightLog& log = flown.log;
    std::vector<const FlightChannel*> channels;
    std::string layout = "format: kphi-flight-layout/1\nseries:\n  - {channel: time, series: t, unit: s}\n",
                names = "t";
    const auto add = [&](const FlightChannel& channel, const char* name, std::size_t number, const char* unit) {
      const std::string series = fmt::format("{}{}", name, number);
      layout += fmt::format("  - {{channel: {}, {}series: {}, unit: {}}}\n", name,
                            number > 0 ? fmt::format("number: {}, ", number) : "", series, unit);
      names += "," + series;
      channels.push_back(&channel);
    };
    for (std::size_t i = 0; i < 3; ++i) {
      add(log.specific_force[i], "specific_force", i + 1, "m/s^2");
      add(log.angular_rate[i], "angular_rate", i + 1, "rad/s");
    }
    for (std::size_t i = 0; i < 4; ++i) {
      add(log.rotor_speed[i], "rotor_speed", i + 1, "rad/s");
      add(log.arm_angle[i], "arm_angle", i + 1, "rad");
    }
    add(log.height, "height", 0, "m");
    add(log.climb, "climb", 0, "m/s");
    std::ofstream table(folder_ / "flight.csv");
    table << names << "\n";
    for (double time = 0; time < log.height.time_s.back(); time += 0.01) {
      table << fmt::format("{:.3f}", time);
      for (const FlightChannel* one : channels) table << fmt::format(",{:.6g}", at(*one, time));
      table << "\n";
    }
    std::ofstream(folder_ / "layout.yaml") << layout;
  }

  /// A table of k as a bench would find it, whose k falls `steep` times as much.
  void bench(const flown_log::Truth& truth, double steep, double level = 1) {
    std::ofstream table(folder_ / "K.csv");
    table << "phi_deg,k_n_s2_per_rad2,u_k_n_s2_per_rad2\n";
    for (const double phi : {0.0, 30.0, 60.0, 90.0})
      table << fmt::format("{},{:.6e},{:.3e}\n", phi, level * truth.k_t * (1 - steep * truth.fall * phi * M_PI / 180),
                           0.004 * truth.k_t);
    table.close();
    const Answer fitted = type("fit K.csv --anchored --accept --no-report --out bench.yaml");
    ASSERT_EQ(fitted.code, 0) << fitted.err;
  }

  Answer type(const std::string& line) {
    Process process(
        {"/bin/bash", "-c", fmt::format("cd '{}' && '{}' {}", folder_.path().string(), test::kphi(), line)});
    const int code = process.wait();
    return {code, process.out(), process.err()};
  }

  Answer fit(const FlownLog& flown, const std::string& more = "") {
    return type(fmt::format("fit flight.csv --layout layout.yaml --vehicle {} --mass {} --out flight.yaml {}", kVehicle,
                            flown.truth.told_kg, more));
  }

  const std::string kVehicle = test::source_dir() + "/profiles/foldable_drone.yaml";
  test::TemporaryFolder folder_;
};

TEST_F(FlightProgram, FitsComparesAndFliesAFlight) {
  const FlownLog flown = flown_log::fly(Kind::arms_moving, 21, {.seconds = 100});
  write(flown);
  const Answer fitted = fit(flown, "--accept");  // nothing was flown between 0° and 65°
  ASSERT_EQ(fitted.code, 0) << fitted.out << fitted.err;
  EXPECT_THAT(fitted.out, AllOf(HasSubstr("collective ±"), HasSubstr("what a flight tells best"), HasSubstr("K_T to"),
                                HasSubstr("rotors")));
  EXPECT_LT(fitted.out.find("collective ±"), fitted.out.find("K_T to")) << "what was excited comes first";
  const auto file = compensation::load_coefficients((folder_ / "flight.yaml").string());
  EXPECT_THAT(file.provenance.flight, HasSubstr("foldable_drone"));
  ASSERT_TRUE(file.thrust_coefficient);
  EXPECT_LT(std::abs(file.curve.thrust_coefficient().value() - flown.truth.k_t),
            1.5 * file.thrust_coefficient->expanded_95);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "flight.html"));

  bench(flown.truth, 1);
  const Answer same = type("compare bench.yaml flight.yaml --expect agree");
  EXPECT_EQ(same.code, 0) << same.out;
  EXPECT_THAT(same.out, HasSubstr("/K_T"));
  bench(flown.truth, 1.3);
  const Answer steeper = type("compare bench.yaml flight.yaml --expect differ");
  EXPECT_EQ(steeper.code, 0) << steeper.out;
  EXPECT_THAT(steeper.out, HasSubstr("k(φ)/K_T differs"));
  bench(flown.truth, 1, 1.06);
  const Answer heavier = type("compare bench.yaml flight.yaml --expect differ");
  EXPECT_EQ(heavier.code, 0) << heavier.out;
  EXPECT_THAT(heavier.out, HasSubstr("one factor in all k"));

  const Answer again =
      type(fmt::format("fly --coefficients bench.yaml --vehicle {} --world flight.yaml --experiment "
                       "hover_xo_c --json",
                       kVehicle));
  ASSERT_EQ(again.code, 0) << again.err;
  const auto world = nlohmann::json::parse(again.out);
  EXPECT_NEAR(world["world"]["k_t_n_per_rad2_s2"].get<double>(), file.curve.thrust_coefficient().value(), 1e-12);
  EXPECT_GT(world["gamma"].get<double>(), 0.5);
}

TEST_F(FlightProgram, WritesATableOfWhatWasFlownThatComparesWithABench) {
  const FlownLog flown = flown_log::fly(Kind::arms_moving, 23, {.seconds = 100});
  write(flown);
  const Answer fitted = fit(flown, "--accept --form table --no-report");
  ASSERT_EQ(fitted.code, 0) << fitted.out << fitted.err;
  const auto file = compensation::load_coefficients((folder_ / "flight.yaml").string());
  ASSERT_GE(file.table.size(), 2u) << "K_T, and at least one angle that was flown";
  for (const auto& row : file.table) {
    ASSERT_TRUE(row.uncertainty);
    const double phi = row.occlusion.value(), truth = flown.truth.k_t * flown.truth.ratio(phi);
    EXPECT_NEAR(row.k.value(), truth, 1.5 * row.uncertainty->expanded_95) << to_degrees(row.occlusion) << " deg";
    EXPECT_NEAR(file.curve.at(row.occlusion).value(), row.k.value(), 1e-5 * row.k.value());
  }
  bench(flown.truth, 1);
  EXPECT_EQ(type("compare bench.yaml flight.yaml --expect agree").code, 0);
  bench(flown.truth, 2);
  EXPECT_EQ(type("compare bench.yaml flight.yaml --expect differ").code, 0);
}

TEST_F(FlightProgram, SaysWhatIsMissingInOneLine) {
  const FlownLog flown = flown_log::fly(Kind::arms_moving, 22, {.seconds = 40});
  write(flown);
  const Answer no_vehicle = type("fit flight.csv --layout layout.yaml");
  EXPECT_EQ(no_vehicle.code, 2);
  EXPECT_THAT(no_vehicle.err, HasSubstr("--vehicle"));
  const Answer hubs = type(fmt::format(
      "fit flight.csv --layout layout.yaml --vehicle {}/profiles/telescoping_quad.yaml", test::source_dir()));
  EXPECT_EQ(hubs.code, 2);
  EXPECT_THAT(hubs.err, HasSubstr("--shape"));
  const Answer loss = fit(flown, "--curve-loss huber");
  EXPECT_EQ(loss.code, 2);
  EXPECT_THAT(loss.err, HasSubstr("is for a bench"));
  std::ofstream(folder_ / "none.csv") << "time,specific_force1\n0,0\n0.01,0\n0.02,0\n";
  std::ofstream(folder_ / "none.yaml")
      << "format: kphi-flight-layout/1\nseries:\n  - {channel: time, series: time, unit: s}\n"
         "  - {channel: specific_force, number: 1, series: specific_force1, unit: m/s^2}\n";
  const Answer none = type(fmt::format("fit none.csv --layout none.yaml --vehicle {}", kVehicle));
  EXPECT_EQ(none.code, 5) << none.err;
  EXPECT_THAT(none.err, HasSubstr("none.csv: the log has no acceleration"));
}

}  // namespace flight_program_test
}  // namespace kphi::fit
