// The subcommand `kphi fly`.
#pragma once

namespace CLI {
class App;
}

namespace kphi::flight {

/// Registers `kphi fly`. When it ran, `exit_code` is 0, 1 (output could not be written) or 2 (a file cannot be used).
void add_fly(CLI::App& program, int& exit_code);

}  // namespace kphi::flight
