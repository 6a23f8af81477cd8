#include "profiles/commands.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace {

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

Outcome run(const std::string& line) {
  CLI::App program;
  Outcome outcome;
  add_check(program, outcome.exit_code);
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
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out, testing::HasSubstr("icra2021_5in_3blade.yaml: campaign in order\n  propeller  5x3"));
  EXPECT_EQ(outcome.err, "");
}

TEST(CheckCommand, PrintsErrorsOnStderrAndExitsWithTwo) {
  const Outcome outcome = run("check /no/such.yaml " + shipped("bench_lab.yaml"));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err, "/no/such.yaml: cannot be opened: No such file or directory; check the name\n");
  EXPECT_THAT(outcome.out, testing::HasSubstr("bench_lab.yaml: bench in order"));
}

TEST(CheckCommand, PrintsOneJsonObjectPerFile) {
  const Outcome outcome = run("check --json /no/such.yaml " + shipped("bench_lab.yaml"));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err, "");
  std::istringstream lines(outcome.out);
  std::string first, second, rest;
  std::getline(lines, first);
  std::getline(lines, second);
  EXPECT_FALSE(std::getline(lines, rest));
  EXPECT_EQ(nlohmann::json::parse(first)["ok"], false);
  EXPECT_EQ(nlohmann::json::parse(second)["kind"], "bench");
}

}  // namespace
}  // namespace kphi::profiles
