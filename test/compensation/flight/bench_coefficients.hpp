// Coefficients as a user gets them: a campaign on the deterministic bench and a fit, both through the program.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "test/end_to_end/process.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::test {

/// The coefficients.yaml of `campaign` (a file) on `bench`, written below `folder`.
inline std::string bench_coefficients(const std::string& campaign, const std::string& bench,
                                      const TemporaryFolder& folder) {
  Process run({test::kphi(), "run", campaign, "--bench", bench, "--yes", "--out", (folder / "campaign").string()});
  EXPECT_EQ(run.wait(std::chrono::seconds(600)), 0) << run.err();
  const std::string results = run.out().substr(0, run.out().find('\n'));
  Process fit({test::kphi(), "fit", results});
  EXPECT_EQ(fit.wait(std::chrono::seconds(120)), 0) << fit.err();
  return results + "/coefficients.yaml";
}

}  // namespace kphi::test
