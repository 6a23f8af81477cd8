// The program on a simulated bench whose wire fails by a script: what is recorded equals what truly happened.
#include <gmock/gmock.h>

#include "results/run_reader.hpp"
#include "test/end_to_end/running_bench.hpp"
#include "test/profiles/refusals.hpp"

namespace kphi::test::faulty_wire_test {

using nlohmann::json;
using namespace testing;

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
  const Ended devices = ran({kphi(), "devices", "--bench", bench.path("bench.yaml"), "--json"});
  EXPECT_GT(json::parse(devices.out)[0]["stream"]["lost_network"], 0);
  const std::string folder = ran(bench.run_command()).folder();
  for (const char* verb : {"verify", "replay"}) (void)ran({kphi(), verb, folder});
  const json info = json::parse(ran({kphi(), "info", "--json", folder}).out);
  (void)bench.account();
  EXPECT_THAT(bench.process().err(), AllOf(HasSubstr("records_dropped"), HasSubstr("foreign")));
  const std::vector<json> log = lines_of(bench.path("wire.jsonl"));
  EXPECT_EQ(log.front()["event"], "http_charset");
  const auto totals = std::ranges::find_if(log, [](const json& line) { return line.contains("totals"); });
  ASSERT_NE(totals, log.end());
  int runs = 0;
  std::uint64_t lost = 0, duplicates = 0, malformed = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(bench.path("results"))) {
    if (entry.path().extension() != ".h5") continue;
    const results::RunRecording recording = results::read_run(entry.path());
    ++runs;
    lost += recording.account.lost_network + recording.account.lost_host;
    EXPECT_EQ(recording.account.lost_network,
              truly_lost(log, recording.load_cell.front().ft_sequence, recording.load_cell.back().ft_sequence));
    EXPECT_GT(recording.account.duplicates, 0u);
    EXPECT_GT(recording.account.malformed, 0u);
  }
  EXPECT_EQ(runs, 3);
  EXPECT_GT(lost, 0u);
  for (const json& one : info.at("runs")) {
    lost -= one.at("lost_network").get<std::uint64_t>() + one.at("lost_host").get<std::uint64_t>();
    duplicates += one.at("duplicates").get<std::uint64_t>();
    malformed += one.at("malformed").get<std::uint64_t>();
  }
  EXPECT_EQ(lost, 0u) << "kphi info tells it";
  EXPECT_GT(duplicates, 0u);
  EXPECT_GT(malformed, 0u);
  // What goes wrong before a run's first record or after its last does not belong to the run.
  EXPECT_LE(duplicates, totals->at("totals").at("records_duplicated").get<std::uint64_t>());
  EXPECT_LE(malformed, totals->at("totals").at("malformed").get<std::uint64_t>());
}

TEST(FaultInjector, NamesInLatin1ReachNoTerminalAsRawBytes) {
  RunningBench bench(Manner{4, 7000, "  - {at_s: 0, for_s: 100000, kind: http_charset}\n"});
  const Ended devices = ran({kphi(), "devices", "--details", "--bench", bench.path("bench.yaml")});
  EXPECT_THAT(devices.out, HasSubstr("Pr\uFFFDfstand"));
  EXPECT_THAT(devices.out + devices.err, Not(HasSubstr("\xFC")));
}

TEST(FaultInjector, ACellThatRepeatsOneValueIsNamedByDevicesAndRefusedByARun) {
  RunningBench bench(Manner{4, 7000, "  - {at_s: 0, kind: frozen, axes: 4}\n"});
  const Ended devices = ran({kphi(), "devices", "--bench", bench.path("bench.yaml")}, 1);
  EXPECT_THAT(devices.out, AllOf(HasSubstr("noise 0."), HasSubstr("Fz repeats one value in all "),
                                 Not(HasSubstr("Fx repeats one value"))));
  EXPECT_THAT(ran(bench.run_command(), 4).err, HasSubstr("Fz repeated one value in all"));
  EXPECT_TRUE(safely(bench.account().last_speed_at() < 0)) << "nothing has turned";
}

TEST(FaultInjector, ABoxThatRebootsInsideTheZeroIsSaidToFlagNoStepThatHasAZero) {
  RunningBench bench(Manner{4, 7000, "  - {at_s: 16, kind: reboot, down_s: 0.1, resume: true}\n"});
  write(bench.path("short.yaml"), profiles::changed(short_campaign_text("0", 1, 3), "zero_s: 0.5", "zero_s: 20"));
  const Ended run = ran(bench.run_command());
  std::filesystem::path file;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(bench.path("results")))
    if (entry.path().extension() == ".h5") file = entry.path();
  const results::RunRecording kept = results::read_run(file);
  const auto boot = std::ranges::find(kept.events, EventKind::rebooted, &StreamEvent::kind);
  ASSERT_NE(boot, kept.events.end()) << run.err;
  const auto begin = std::ranges::find(kept.phases, results::Phase::zero_before, &results::PhaseMark::phase);
  ASSERT_NE(begin, kept.phases.end());
  ASSERT_GT(boot->time_ns, begin->time_ns);
  ASSERT_LT(boot->time_ns, std::next(begin)->time_ns) << "inside the zero";
  EXPECT_THAT(bytes_of(std::filesystem::path(run.folder()) / "steps.csv"), Not(HasSubstr("rebooted")));
  EXPECT_THAT(run.err, AllOf(HasSubstr("the box has booted"), HasSubstr("without a zero taken since are flagged")));
}

TEST(FaultInjector, APageInUtf16IsRefusedInOneLine) {
  RunningBench bench(Manner{4, 7000, "  - {at_s: 0, for_s: 100000, kind: http_charset, utf16: true}\n"});
  EXPECT_THAT(ran(bench.run_command(), 3).err, AllOf(HasSubstr("NUL byte"), HasSubstr("power-cycle the box")));
}

TEST(FaultInjector, OtherUnitsDuringARunStopItAndAreNamed) {
  RunningBench bench(Manner{4, 7000, "  - {at_s: 20, kind: units, force_unit: 4}\n"});
  write(bench.path("short.yaml"), short_campaign_text("0", 1, 60));  // one run of 36 s and more
  const Ended run = ran(bench.run_command(), 4);
  EXPECT_THAT(run.err, AllOf(HasSubstr("configuration changed since the run began: units, counts per unit"),
                             HasSubstr("SAFETY STOP: thrust ")));
  const auto folder = campaign_below(bench.path("results"), "faults.yaml");
  ASSERT_TRUE(folder);
  EXPECT_EQ(bytes_of(folder->path() / "faults.yaml"), bytes_of(bench.path("faults.yaml")));
}

TEST(BadScript, OrATruthLogThatCannotBeWrittenIsNamedBeforeTheSimulatorStarts) {
  const TemporaryFolder folder;
  write(folder / "bench.yaml", bench_text(folder.path(), 49152, 8049, 1));
  const auto refused = [&](const char* option, const std::filesystem::path& file, int exit_code, const char* words) {
    const Ended sim =
        ran({kphi(), "sim", (folder / "bench.yaml").string(), "--free-ports", option, file.string()}, exit_code);
    EXPECT_THAT(sim.err, HasSubstr(words));
    EXPECT_EQ(sim.out, "");
  };
  write(folder / "faults.yaml", "format: kphi-faults/1\nfaults:\n  - {at_s: 0, for_s: 1, kind: los}\n");
  refused("--faults", folder / "faults.yaml", 2,
          "faults.yaml:3:31: unknown fault \"los\" of the load cell; known: loss, gilbert");
  write(folder / "faults.yaml", "faults: [\n");
  refused("--faults", folder / "faults.yaml", 2, "faults.yaml:2:1: ");
  refused("--faults", folder / "none.yaml", 2,
          "none.yaml: cannot be opened: No such file or directory; check the name");
  refused("--faults", folder.path(), 2, "is a folder; name a file");
  refused("--truth-log", folder / "no/such/log.jsonl", 2, "no/such/log.jsonl: the folder");
}

}  // namespace kphi::test::faulty_wire_test
