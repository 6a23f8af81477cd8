// The program on a simulated bench whose wire fails by a script: what is recorded equals what truly happened.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <map>
#include <sstream>

#include "results/run_reader.hpp"
#include "test/end_to_end/running_bench.hpp"

namespace kphi::test {
namespace faulty_wire_test {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

std::vector<json> lines_of(const std::string& path) {
  std::istringstream text(bytes_of(path));
  std::vector<json> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(json::parse(line));
  return lines;
}

/// Records between the first and the last of a run that the wire lost, by the simulator's log.
std::uint64_t truly_lost(const std::vector<json>& log, std::uint32_t first_ft, std::uint32_t last_ft) {
  std::uint64_t lost = 0;
  for (const json& line : log) {
    if (!line.contains("first_ft") || line["arrivals"] != 0) continue;
    const auto ft = line["first_ft"].get<std::uint32_t>();
    if (ft > first_ft && ft < last_ft) lost += line["records"].get<std::uint64_t>();
  }
  return lost;
}

TEST(FaultInjector, WhatARunSaysItLostIsWhatTheWireTookFromIt) {
  RunningBench bench(Manner{4, 7000,
                            "  - {at_s: 0, for_s: 100000, kind: loss, p: 0.01, burst: 3}\n"
                            "  - {at_s: 0, for_s: 100000, kind: duplicate, p: 0.02}\n"
                            "  - {at_s: 0, for_s: 100000, kind: foreign_source, p: 0.02}\n"
                            "  - {at_s: 0, for_s: 100000, kind: wrong_size, p: 0.02, size: 71}\n"
                            "  - {at_s: 0, for_s: 100000, kind: http_charset}\n"});
  Process devices({kphi(), "devices", "--bench", bench.path("bench.yaml"), "--json"});
  EXPECT_EQ(devices.wait(), 0) << devices.err();
  EXPECT_GT(json::parse(devices.out())[0]["stream"]["lost_network"], 0);
  Process run(bench.run_command());
  ASSERT_EQ(run.wait(), 0) << run.err();
  bench.process().signal(SIGTERM);
  EXPECT_EQ(bench.process().wait(), 0);
  EXPECT_THAT(bench.process().err(), AllOf(HasSubstr("records_dropped"), HasSubstr("foreign")));
  const std::vector<json> log = lines_of(bench.path("wire.jsonl"));
  EXPECT_EQ(log.front()["event"], "http_charset");
  int runs = 0;
  std::uint64_t lost = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(bench.path("results"))) {
    if (entry.path().extension() != ".h5") continue;
    const results::RunRecording recording = results::read_run(entry.path());
    ++runs;
    lost += recording.account.lost_network;
    EXPECT_EQ(recording.account.lost_network,
              truly_lost(log, recording.load_cell.front().ft_sequence, recording.load_cell.back().ft_sequence));
    EXPECT_GT(recording.account.duplicates, 0u);
    EXPECT_GT(recording.account.malformed, 0u);
  }
  EXPECT_EQ(runs, 3);
  EXPECT_GT(lost, 0u);
}

TEST(FaultInjector, NamesInLatin1ReachNoTerminalAsRawBytes) {
  RunningBench bench(Manner{4, 7000, "  - {at_s: 0, for_s: 100000, kind: http_charset}\n"});
  Process devices({kphi(), "devices", "--bench", bench.path("bench.yaml")});
  EXPECT_EQ(devices.wait(), 0) << devices.err();
  EXPECT_THAT(devices.out(), HasSubstr("Pr\uFFFDfstand"));
  EXPECT_THAT(devices.out() + devices.err(), testing::Not(HasSubstr("\xFC")));
}

TEST(FaultInjector, APageInUtf16IsRefusedInOneLine) {
  RunningBench bench(Manner{4, 7000, "  - {at_s: 0, for_s: 100000, kind: http_charset, utf16: true}\n"});
  Process run(bench.run_command());
  EXPECT_EQ(run.wait(), 3) << run.err();
  EXPECT_THAT(run.err(), AllOf(HasSubstr("NUL byte"), HasSubstr("power-cycle the box")));
}

TEST(FaultInjector, OtherUnitsDuringARunAreNoticedAtItsEnd) {
  RunningBench bench(Manner{4, 7000, "  - {at_s: 20, kind: units, force_unit: 4}\n"});
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 60));  // one run of 36 s and more
  Process run(bench.run_command());
  EXPECT_EQ(run.wait(), 0) << run.err();
  EXPECT_THAT(run.err(), AllOf(HasSubstr("configuration changed since the run began: units, counts per unit"),
                               HasSubstr("60 of 60 steps flagged")));
  const std::string folder = run.out().substr(0, run.out().find('\n'));
  EXPECT_EQ(bytes_of(folder + "/faults.yaml"), bytes_of(bench.path("faults.yaml")));
}

TEST(FaultInjector, AStreamTakenOverEndsTheCampaignWithTheMotorStopped) {
  RunningBench bench(Manner{4, 7000, "  - {at_s: 24, kind: taken_over}\n"});
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 60));  // one run of 36 s and more
  Process run(bench.run_command());
  EXPECT_EQ(run.wait(), 4) << run.err();
  EXPECT_THAT(run.err(), HasSubstr("this run so far in "));
  EXPECT_TRUE(bench.motor_stops());
}

class BadScript : public testing::Test {
 protected:
  /// Exit code and words of a simulator that must not start.
  void refused(const std::vector<std::string>& options, int exit_code, const std::string& words) {
    write(folder_.path() / "bench.yaml", bench_text(folder_.path(), 49152, 8049, 1));
    std::vector<std::string> command{kphi(), "sim", (folder_ / "bench.yaml").string(), "--free-ports"};
    command.insert(command.end(), options.begin(), options.end());
    Process sim(command);
    EXPECT_EQ(sim.wait(), exit_code);
    EXPECT_THAT(sim.err(), HasSubstr(words));
    EXPECT_EQ(sim.out(), "");
  }
  void refused_script(const std::string& text, const std::string& words) {
    write(folder_.path() / "faults.yaml", text);
    refused({"--faults", (folder_ / "faults.yaml").string()}, 2, "faults.yaml" + words);
  }
  TemporaryFolder folder_;
};

TEST_F(BadScript, IsRefusedByLineAndColumn) {
  refused_script("format: kphi-faults/1\nfaults:\n  - {at_s: 0, for_s: 1, kind: los}\n",
                 ":3:31: unknown fault \"los\" of the load cell; known: loss, gilbert");
  refused_script("format: kphi-faults/1\nfaults:\n  - at_s: 0\n    kind: reboot\n    down: 1\n",
                 ":5:11: reboot has no key \"down\"");
  refused_script("format: kphi-faults/1\nquirks: {axia: 1}\nfaults: []\n", ":2:16: \"1\" is not one of false, true");
  refused_script("faults: [\n", ":2:1: ");
}

TEST_F(BadScript, ThatCannotBeReadIsNamed) {
  refused({"--faults", (folder_ / "none.yaml").string()}, 2,
          "none.yaml: cannot be opened: No such file or directory; check the name");
  refused({"--faults", folder_.path().string()}, 2, "is a folder; name a file");
}

TEST_F(BadScript, OrATruthLogThatCannotBeWrittenIsRefusedAtTheBeginning) {
  refused({"--truth-log", (folder_ / "no/such/log.jsonl").string()}, 1, "no/such/log.jsonl");
}

}  // namespace faulty_wire_test
}  // namespace kphi::test
