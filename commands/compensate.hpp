// The subcommand `kphi compensate`.
#pragma once

namespace CLI {
class App;
}

namespace kphi::compensation {

/// Registers `kphi compensate`. When it ran, `exit_code` is 0, 1 (output could not be written), 2 (a file or the header
/// cannot be used) or 5 (some rows were rejected).
void add_compensate(CLI::App& program, int& exit_code);

}  // namespace kphi::compensation
