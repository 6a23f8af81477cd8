// A verb of the program, called in this process.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "commands/commands.hpp"

namespace kphi::test {

struct Said {
  int code = -1;
  std::string out, err;
};

/// `line`: "check --json FILE".
inline Said say(const std::string& line) {
  CLI::App program;
  ExitCode code = ExitCode::failure;
  for (commands::AddVerb* add : commands::kVerbs) add(program, code);
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  program.parse(line);
  std::fflush(nullptr);
  const std::string out = testing::internal::GetCapturedStdout();
  return {static_cast<int>(code), out, testing::internal::GetCapturedStderr()};
}

}  // namespace kphi::test
