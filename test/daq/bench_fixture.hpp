// A short campaign on the deterministic bench, in a folder of its own.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "daq/campaign/operator.hpp"
#include "daq/run/run.hpp"
#include "drivers/sim/netbox/settings.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "results/campaign_folder.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::test {

inline std::string bytes_of(const std::filesystem::path& file) {
  std::ostringstream all;
  all << std::ifstream(file, std::ios::binary).rdbuf();  // block by block: test code is not optimized
  return all.str();
}

/// N per (rad/s)² of the simulated propeller "5x3".
inline constexpr double kTrueK5x3 = 1.7e-8 / (kRadPerSecPerRpm * kRadPerSecPerRpm);

/// Name → bytes.
using Files = std::map<std::string, std::string>;

/// Run files and tables.
inline Files measured_in(const results::CampaignFolder& folder) {
  Files files;
  for (const auto& run : folder.complete_runs()) files[run.filename().string()] = bytes_of(run);
  for (const auto& table : {folder.steps(), folder.means()}) files[table.filename().string()] = bytes_of(table);
  return files;
}

inline std::string short_campaign_text(const std::string& occlusions = "0, 90", int repetitions = 1, int steps = 4) {
  return fmt::format(
      "format: kphi-campaign/1\nname: short\n"
      "propeller: {{id: 5x3, name: 5-inch three-blade, diameter_in: 5, blades: 3}}\n"
      "occlusions_deg: [{}]\nrepetitions: {}\nrepetitions_extra_max: 0\n"
      "profile: {{steps: {}, dwell_s: 0.6, first_rpm: 6000, last_rpm: 18000}}\n"
      "zero_s: 0.5\nminimum_discard_s: 0.3\nsupply_v: 12.0\n"
      "limits: {{speed_max_rpm: 19100, thrust_max_n: 20, supply_current_max_a: 35, coil_temperature_max_degc: 110}}\n",
      occlusions, repetitions, steps);
}

inline profiles::Campaign short_campaign(const std::string& occlusions = "0, 90", int repetitions = 1, int steps = 4) {
  return profiles::parse_campaign(short_campaign_text(occlusions, repetitions, steps), "short.yaml");
}

/// `faults`: path of a fault script; empty: none.
inline profiles::BenchConfig deterministic_config(int seed, const std::string& faults = {}) {
  return profiles::parse_bench(
      fmt::format(
          "format: kphi-bench/1\nname: test\n"
          "netbox: {{host: 127.0.0.1, rdt_port: 49152, http_port: 8049, rate_hz: 7000, records_per_datagram: 40}}\n"
          "iq: {{device: /dev/null, baud: 921600, module_id: 0, spin: +1, telemetry_hz: 50, speed_max_rpm: 19300}}\n"
          "thrust_axis: \"+Fz\"\nsimulation: {{in_process: true, seed: {}{}}}\n",
          seed, faults.empty() ? "" : ", faults: " + faults),
      "bench.yaml");
}

/// Nobody asks for a stop.
inline bool never() { return false; }

/// Keys that a test presses.
struct PressedKeys final : daq::Keys {
  explicit PressedKeys(std::function<std::optional<daq::Key>()> pressed) : press(std::move(pressed)) {}
  [[nodiscard]] std::optional<daq::Key> next() override { return press(); }
  void forget(const std::function<void()>& poll) override {
    poll();
    ++forgotten;
  }
  std::function<std::optional<daq::Key>()> press;
  int forgotten = 0;  ///< times
};

/// Of the error that the call throws; "": it throws none.
template <class Error, class Call>
std::string words_of(Call&& call) {
  try {
    (void)call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// A stream, and what was written to it.
class Written {
 public:
  ~Written() {
    std::fclose(stream);
    std::free(text_);
  }
  std::string text() {
    std::fflush(stream);
    return {text_, size_};
  }

 private:
  char* text_ = nullptr;
  std::size_t size_ = 0;

 public:
  std::FILE* const stream = open_memstream(&text_, &size_);
};

/// Keeps the lines that a run says, and calls `then` with each, and `at_tick`.
class SaidLines final : public daq::Progress {
 public:
  void tick(const daq::Position& position, const daq::Observation& seen) override {
    if (at_tick) at_tick(position, seen);
  }
  void step_done(const daq::Position& position, const daq::Observation& seen) override { tick(position, seen); }
  void say(const std::string& line) override {
    lines.push_back(line);
    if (then) then(line);
  }
  void asks(const daq::StandQuestion& question) override { questions.push_back(question.text); }
  /// Lines with these words.
  [[nodiscard]] std::ptrdiff_t count(const std::string& words) const {
    return std::count_if(lines.begin(), lines.end(),
                         [&](const std::string& line) { return line.find(words) != std::string::npos; });
  }
  std::vector<std::string> lines, questions;
  std::function<void(const std::string&)> then;
  std::function<void(const daq::Position&, const daq::Observation&)> at_tick;
};

/// Remembers what it was asked, refuses to mount `refuse_at_deg`, does something at the stand, and decides as it is
/// told.
class ScriptedOperator final : public daq::Operator {
 public:
  using Operator::poll;
  [[nodiscard]] bool run_again(const daq::AnotherRun& question) override {
    questions.push_back(question);
    return decision;
  }
  std::string propeller;
  std::vector<double> mounted_deg;
  std::vector<daq::AnotherRun> questions;
  double refuse_at_deg = -1;
  std::function<void()> at_the_stand;
  bool decision = true;

 protected:
  void mount(const profiles::Propeller& under, double occlusion_deg, const std::string&) override {
    propeller = under.id;
    mounted_deg.push_back(occlusion_deg);
    if (occlusion_deg == refuse_at_deg) throw daq::NotMounted("no");
    if (at_the_stand) at_the_stand();
  }
};

/// 12 V from the simulated supply.
inline profiles::BenchConfig with_supply(profiles::BenchConfig config, double current_limit_a = 50) {
  config.supply =
      profiles::SupplyConfig{"modbus-rtu:/dev/null", Volts(12), Amperes(current_limit_a), Volts(13.5), Amperes(60)};
  return config;
}

/// The simulated motor stands, or slows down during the next second as only a coasting one does.
template <class Bench>
bool motor_is_let_go(Bench& bench) {
  const double before = std::abs(bench.simulation().plant().motor().speed);
  bench.wait_until(bench.clock().now() + std::chrono::seconds(1));
  const double after = std::abs(bench.simulation().plant().motor().speed);
  return after < 1.0 || after < 0.7 * before;
}

/// A gage bias shifts what the box shows by a fifth of the range.
template <class Bench>
void shift_cell(Bench& bench, std::size_t axis) {
  sim::NetBoxSettings settings;
  settings.bias_vector[axis] = -6554;
  bench.simulation().netbox().configure(settings);
}

/// The campaign's first run, without occlusion, as if somebody had confirmed that; keeps what it is given.
inline daq::RunOrder first_run(const profiles::Campaign& campaign, const profiles::BenchConfig& config,
                               const std::filesystem::path& file) {
  daq::AutoConfirmOperator person;
  return {campaign,
          config,
          person.confirm_mounting(campaign.propeller, 0),
          profiles::make_plan(campaign, config).runs.front(),
          10.0,
          true,
          0.0,
          file};
}

}  // namespace kphi::test
