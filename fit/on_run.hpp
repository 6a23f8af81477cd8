// What a command of this room does with the errors of this room.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <utility>

#include "compensation/file/coefficient_file.hpp"
#include "fit/fit_error.hpp"
#include "profiles/configuration_error.hpp"

namespace kphi::fit {

inline constexpr int kDataRejected = 5;

/// Runs `work` as the command's callback; data that cannot be fitted become one line and exit code 5.
inline void on_run(CLI::App& command, int& exit_code, std::function<void()> work) {
  command.callback([&exit_code, work = std::move(work)] {
    try {
      work();
    } catch (const FitError& error) {
      fmt::print(stderr, "kphi: {}\n", error.what());
      exit_code = kDataRejected;
    } catch (const compensation::CoefficientError& error) {
      throw ConfigurationError(error.what());
    }
  });
}

}  // namespace kphi::fit
