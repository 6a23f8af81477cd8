#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "test/profiles/refusals.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::profiles {
namespace {

struct Outcome {
  ExitCode exit_code = ExitCode::failure;
  std::string out;
  std::string err;
};

Outcome run(const std::string& line) {
  CLI::App program;
  Outcome outcome;
  commands::add_check(program, outcome.exit_code);
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  program.parse(line);
  std::fflush(nullptr);
  outcome.out = testing::internal::GetCapturedStdout();
  outcome.err = testing::internal::GetCapturedStderr();
  return outcome;
}

TEST(CheckCommand, PrintsSummariesAndExitsWithZero) {
  const Outcome outcome = run("check " + shipped("icra2021_5in_3blade.yaml"));
  EXPECT_EQ(outcome.exit_code, ExitCode::ok);
  EXPECT_THAT(outcome.out, testing::HasSubstr("icra2021_5in_3blade.yaml: valid campaign\n  propeller  5x3"));
  EXPECT_EQ(outcome.err, "");
}

TEST(CheckCommand, PrintsErrorsOnStderrAndExitsWithTwo) {
  const Outcome outcome = run("check /no/such.yaml " + shipped("bench_lab.yaml"));
  EXPECT_EQ(outcome.exit_code, ExitCode::usage);
  EXPECT_EQ(outcome.err, "/no/such.yaml: cannot be opened: No such file or directory; check the name\n");
  EXPECT_THAT(outcome.out, testing::HasSubstr("bench_lab.yaml: valid bench"));
}

TEST(CheckCommand, PrintsOneJsonObjectPerFile) {
  const Outcome outcome = run("check --json /no/such.yaml " + shipped("bench_lab.yaml"));
  EXPECT_EQ(outcome.exit_code, ExitCode::usage);
  EXPECT_EQ(outcome.err, "");
  std::istringstream lines(outcome.out);
  std::string first, second, rest;
  std::getline(lines, first);
  std::getline(lines, second);
  EXPECT_FALSE(std::getline(lines, rest));
  EXPECT_EQ(nlohmann::json::parse(first)["ok"], false);
  EXPECT_EQ(nlohmann::json::parse(second)["kind"], "bench");
}

TEST(CheckCommand, ReadsTheShippedFaultScriptAndTellsWhatWillGoWrong) {
  const Outcome outcome = run("check " + shipped("faults_example.yaml"));
  EXPECT_EQ(outcome.exit_code, ExitCode::ok);
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, testing::HasSubstr("faults_example.yaml: valid fault script\n  at 0 s  loss for 3600 s\n"));
  EXPECT_THAT(outcome.out, testing::HasSubstr("\n  at 60 s  reboot\n"));
  EXPECT_THAT(outcome.out, testing::HasSubstr("\n  at 500 s  http_slow, at most 1 times\n"));
}

TEST(CheckCommand, ReadsTheShippedMotor) {
  const Outcome outcome = run("check " + shipped("motor_iq2306.yaml"));
  EXPECT_EQ(outcome.exit_code, ExitCode::ok) << outcome.err;
  EXPECT_THAT(outcome.out, testing::HasSubstr("valid simulated motor\n  motor      2221 RPM/V, 0.045 ohm"));
}

TEST(CheckCommand, RefusesAFaultScriptAtItsLineAndColumn) {
  const kphi::test::TemporaryFolder folder;
  const auto refused = [&](const std::string& text, const std::string& words) {
    const std::string path = (folder.path() / "bad.yaml").string();
    std::ofstream(path) << text;
    const Outcome outcome = run("check " + path);
    EXPECT_EQ(outcome.exit_code, ExitCode::usage);
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, testing::StartsWith(path + words));
  };
  refused("format: kphi-faults/1\nfaults:\n  - {at_s: 0, for_s: 1, kind: los}\n",
          ":3:31: unknown fault \"los\" of the load cell");
  refused("format: kphi-faults/1\nfaults:\n  - {at_s: 0, kind: motor_sag}\n", ":3:5: motor_sag needs for_s");
  refused("format: kphi-sim-motor/1\nmotor: {resistance_ohm: 0}\n", ":2:25: resistance_ohm: 0 is outside 0.001 to 10");
  refused("format: kphi-faults/1\nquirks: {axia: 1}\nfaults: []\n", ":2:16: \"1\" is not one of false, true");
  refused("format: kphi-fault/1\nfaults: []\n",
          ":1:9: unknown format kphi-fault/1; did you mean format: "
          "kphi-faults/1?");
}

}  // namespace
}  // namespace kphi::profiles
