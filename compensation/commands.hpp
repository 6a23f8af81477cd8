// The subcommand `kphi compensate`.
#pragma once

#include "compensation/airframe.hpp"

namespace CLI {
class App;
}
namespace kphi::profiles {
struct Vehicle;
}

namespace kphi::compensation {

/// Registers `kphi compensate`. When it ran, `exit_code` is 0, 1 (output could not be written), 2 (a file or the header
/// cannot be used) or 5 (some rows were rejected).
void add_compensate(CLI::App& program, int& exit_code);

/// What flies, of a vehicle file. Throws ConfigurationError if an arm does not hang on a corner of the body.
[[nodiscard]] Airframe airframe_of(const profiles::Vehicle& vehicle);

}  // namespace kphi::compensation
