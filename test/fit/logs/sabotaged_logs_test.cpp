// Logs of a stand with one mistake each, through import and fit as the commands do them: stopped, or named with its
// cause. KPHI_LOGS: clean ones beside them, 200 otherwise.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "compensation/units.hpp"
#include "fit/logs/import_table.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {
namespace sabotaged_logs_test {

struct Row {
  double time, throttle, thrust, torque, volts, amps, electrical, optical;
};

struct Log {
  std::vector<Row> rows;
  std::string thrust_unit = "N";
  bool electrical = true;  ///< the stand has this speed, too
  std::mt19937_64 random;
};

/// Half a minute of a 5-inch propeller: at rest, up, down, at rest; a stand with drifting noise.
Log clean_log(unsigned seed) {
  constexpr double kK = 1.25e-6, kTorquePerThrust = 0.0128, kEfficiency = 0.7;
  constexpr int kRest = 80, kRamp = 400;
  Log log;
  log.random.seed(seed);
  std::normal_distribution<double> normal;
  double slow = 0;
  for (int i = 0; i < 2 * kRest + kRamp; ++i) {
    const bool turns = i >= kRest && i < kRest + kRamp;
    const double share = turns ? 1 - std::abs((i - kRest) / (kRamp / 2.0) - 1) : 0;
    const double rpm = turns ? 3000 + 13000 * share + 4 * normal(log.random) : 0;
    const double speed = from_rpm(rpm).value(), thrust = kK * speed * speed;
    slow = 0.5 * slow + 0.004 * normal(log.random);
    const double torque = -kTorquePerThrust * thrust, volts = 11.8 - 0.02 * thrust;
    log.rows.push_back({0.05 * i, turns ? 1150 + 700 * share : 1000, thrust + slow + 0.003 * normal(log.random),
                        torque + 2e-5 * normal(log.random), volts, std::abs(torque) * speed / kEfficiency / volts + 0.1,
                        std::round(rpm), std::round(rpm)});
  }
  return log;
}

std::string text_of(const Log& log) {
  std::string text = fmt::format(
      "Time (s),ESC signal (µs),Thrust ({}),Torque (N·m),Voltage (V),Current (A){},Motor "
      "Optical Speed (RPM)\n",
      log.thrust_unit, log.electrical ? ",Motor Electrical Speed (RPM)" : "");
  for (const Row& row : log.rows)
    text += fmt::format("{:.2f},{:.0f},{:.5f},{:.6f},{:.3f},{:.3f}{},{:.1f}\n", row.time, row.throttle, row.thrust,
                        row.torque, row.volts, row.amps, log.electrical ? fmt::format(",{:.1f}", row.electrical) : "",
                        row.optical);
  return text;
}

/// Findings that are remarks on a good log, too: a stand has slow noise and coasts.
bool is_remark(FindingKind kind) { return kind == FindingKind::correlated_noise; }

std::vector<std::string> said_of(const Log& log) {
  std::vector<std::string> said;
  try {
    for (const Import& import : import_groups(text_of(log), "own_5x3.csv", {.diameter_in = 5, .blades = 3})) {
      const JudgedFit judged = judged_fit(import.table);
      for (const auto* list : {&import.findings, &judged.findings})
        for (const LogFinding& finding : *list)
          if (!is_remark(finding.kind)) said.push_back(fmt::format("{}: {}", name_of(finding.kind), finding.text));
      std::vector<results::StepMean> steps;
      for (std::size_t row = 0; row < import.table.size(); ++row) steps.push_back(import.table.step(row));
      const Identification found = identify(steps, {.mounted_once = true});
      if (!(found.thrust_coefficient().value > 0)) said.emplace_back("K_T must be positive");
      for (const Doubt& doubt : analyse(found).flight.doubts)
        if (doubt.readiness == Readiness::not_yet) said.push_back(doubt.text);
    }
  } catch (const std::runtime_error& refused) {
    said.emplace_back(refused.what());
  }
  return said;
}

struct Mistake {
  const char* name;
  std::function<void(Log&)> make;
  std::vector<std::string> named_as;  ///< any one is enough
};

std::function<void(Log&)> each(std::function<void(Row&)> change) {
  return [change = std::move(change)](Log& log) { std::ranges::for_each(log.rows, change); };
}

std::function<void(Log&)> one_speed(double factor) {
  return [factor](Log& log) {
    log.electrical = false;
    for (Row& row : log.rows) row.optical *= factor;
  };
}

/// The rows from this share of the log on.
std::function<void(Log&)> later(double from, std::function<void(Row&)> change) {
  return [=](Log& log) {
    const auto first = static_cast<std::ptrdiff_t>(from * static_cast<double>(log.rows.size()));
    std::for_each(log.rows.begin() + first, log.rows.end(), change);
  };
}

/// One in `of` rows.
std::function<void(Log&)> some(int of, std::function<void(Row&)> change) {
  return [=](Log& log) {
    std::uniform_int_distribution<int> die(1, of);
    for (Row& row : log.rows)
      if (die(log.random) == 1) change(row);
  };
}

void without_rest(Log& log) {
  std::erase_if(log.rows, [](const Row& row) { return row.optical == 0; });
}

const std::vector<Mistake>& mistakes() {
  static const std::vector<std::string> kUnit{"C_T", "ideal disk", "do not belong together", "the shaft gives"};
  static const std::vector<Mistake> all{
      {"thrust in gram-force", each([](Row& row) { row.thrust *= 101.97; }), kUnit},
      {"thrust in kilogram-force", each([](Row& row) { row.thrust /= 9.80665; }), kUnit},
      {"thrust in ounce-force", each([](Row& row) { row.thrust *= 3.597; }), kUnit},
      {"thrust in pound-force", each([](Row& row) { row.thrust /= 4.44822; }), kUnit},
      {"thrust of four rotors", each([](Row& row) { row.thrust *= 4; }), kUnit},
      {"sign of the thrust", each([](Row& row) { row.thrust *= -1; }), {"sign is reversed"}},
      {"speed in rad/s", one_speed(1 / 9.5493), {"rad/s"}},
      {"electrical speed, seven pole pairs", one_speed(7), kUnit},
      {"speed of a gear of two", one_speed(0.5), kUnit},
      {"fourteen poles set for twelve", each([](Row& row) { row.electrical *= 6.0 / 7; }), {"poles"}},
      {"torque in newton centimetre", each([](Row& row) { row.torque *= 100; }), kUnit},
      {"a tenth of the torque", each([](Row& row) { row.torque *= 0.1; }), kUnit},
      {"a current shunt of a tenth", each([](Row& row) { row.amps *= 0.1; }), kUnit},
      {"never tared, with rows at rest", each([](Row& row) { row.thrust += 2; }), {"untared"}},
      {"never tared, without rows at rest",
       [](Log& log) {
         for (Row& row : log.rows) row.thrust -= 2;
         without_rest(log);
       },
       {"zero_fitted", "zero_unknown"}},
      {"the zero drifts",
       [](Log& log) {
         for (Row& row : log.rows) row.thrust += 0.03 * row.time;
       },
       {"zero_drifted"}},
      {"thrust frozen",
       [](Log& log) {
         for (std::size_t i = 250; i < 400; ++i) log.rows[i].thrust = log.rows[250].thrust;
       },
       {"thrust_frozen"}},
      {"speed frozen",
       [](Log& log) {
         log.electrical = false;
         for (std::size_t i = 250; i < 400; ++i) log.rows[i].optical = log.rows[250].optical;
       },
       {"speed_frozen", "one_k_misfits"}},
      {"one speed dies", later(0.4, [](Row& row) { row.electrical = 0; }), {"speed_dead", "speed_missing", "reads 0"}},
      {"speed reads 0 at times",
       [](Log& log) {
         log.electrical = false;
         some(12, [](Row& row) { row.optical = 0; })(log);
       },
       {"speed_missing", "reads 0"}},
      {"speed counted double at times",
       [](Log& log) {
         log.electrical = false;
         some(12, [](Row& row) { row.optical *= 2; })(log);
       },
       {"speed_doubled", "speed_spike"}},
      {"another propeller in half of it", later(0.5, [](Row& row) { row.thrust *= 1.6; }), {"one_k_misfits"}},
      {"turned round in half of it",
       later(0.5, [](Row& row) { row.thrust *= -0.6; }),
       {"one_k_misfits", "negative_thrust", "several_groups", "does not follow"}},
      {"stamps go back", some(30, [](Row& row) { row.time -= 3; }), {"time_backward"}},
  };
  return all;
}

TEST(SabotagedLogs, AreStoppedOrNamedWithTheirCause) {
  constexpr unsigned kEach = 10;
  unsigned told = 0, all = 0;
  for (const Mistake& mistake : mistakes()) {
    unsigned found = 0;
    std::vector<std::string> last;
    for (unsigned seed = 1; seed <= kEach; ++seed) {
      Log log = clean_log(100 + seed);
      mistake.make(log);
      last = said_of(log);
      found += std::ranges::any_of(last,
                                   [&](const std::string& text) {
                                     return std::ranges::any_of(mistake.named_as, [&](const std::string& word) {
                                       return text.find(word) != std::string::npos;
                                     });
                                   })
                   ? 1
                   : 0;
    }
    told += found;
    all += kEach;
    EXPECT_GE(found, 8u) << mistake.name << ": " << fmt::format("{}", testing::PrintToString(last));
  }
  fmt::print("told {} of {}\n", told, all);
  EXPECT_GE(told, 0.95 * all);
}

TEST(SabotagedLogs, AreNotSeenInCleanOnes) {
  const char* const asked = std::getenv("KPHI_LOGS");
  const unsigned logs = asked == nullptr ? 200 : static_cast<unsigned>(std::atoi(asked));
  unsigned named = 0;
  for (unsigned seed = 1; seed <= logs; ++seed) {
    const auto said = said_of(clean_log(1000 + seed));
    if (!said.empty() && named++ < 3) fmt::print("{}\n", said.front());
  }
  fmt::print("named {} of {}\n", named, logs);
  EXPECT_LE(named, 0.02 * logs);
}

}  // namespace sabotaged_logs_test
}  // namespace kphi::fit
