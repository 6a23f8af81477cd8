// kphi devices.
#pragma once

#include <CLI/CLI.hpp>

namespace kphi::daq {

/// Exit code 0 when all answer, 3 when one does not.
void add_devices(CLI::App& program, int& exit_code);

}  // namespace kphi::daq
