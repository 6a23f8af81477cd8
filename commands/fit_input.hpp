// What a command of this room is given: a campaign folder, a folder with a steps.csv, or a file. Belongs to the
// program, since it reads the campaign's own profile files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fit/coefficients/coefficients.hpp"
#include "fit/model/line_fit.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

/// What is fitted, and what is known about where it comes from.
struct FitInput {
  std::vector<results::StepMean> steps;
  std::vector<LinePoint> table;  ///< instead of steps
  Provenance provenance;
  std::filesystem::path folder;  ///< where the outputs go
  bool campaign = false;         ///< `folder` is a campaign folder
};

/// Throws ConfigurationError, naming the next move, for what holds neither steps nor coefficients.
[[nodiscard]] FitInput load_input(const std::string& path);

}  // namespace kphi::fit
