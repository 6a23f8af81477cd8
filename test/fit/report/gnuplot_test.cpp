#include "fit/report/gnuplot.hpp"

#include <gtest/gtest.h>
#include <signal.h>

#include <cstdint>
#include <filesystem>
#include <fstream>

#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace {

/// The set of signals that a program started as gnuplot is ignores, a bit each from signal 1 on.
std::uint64_t ignored_by_a_child(const std::filesystem::path& folder) {
  const auto program = folder / "program.sh";
  std::ofstream(program) << "#!/bin/sh\nexec grep SigIgn: /proc/self/status\n";
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  std::ofstream(folder / "script.gp") << "\n";
  const GnuplotOutcome outcome = draw(folder / "script.gp", folder / "figure.svg", program.string());
  EXPECT_TRUE(outcome.drawn) << outcome.reason;
  std::string name, mask = "0";
  std::ifstream(folder / "figure.svg") >> name >> mask;
  return std::stoull(mask, nullptr, 16);
}

TEST(Gnuplot, IgnoresNoSignalThatThisProgramIgnores) {
  const test::TemporaryFolder folder;
  for (const int number : {SIGPIPE, SIGXFSZ}) {
    const auto before = ::signal(number, SIG_IGN);
    EXPECT_EQ(ignored_by_a_child(folder.path()) >> (number - 1) & 1, 0u) << number;
    ::signal(number, before);
  }
}

}  // namespace
}  // namespace kphi::fit
