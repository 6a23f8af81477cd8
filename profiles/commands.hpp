// The command of this folder: kphi check FILE… [--json]
#pragma once

namespace CLI {
class App;
}

namespace kphi::profiles {

/// Adds `check` to the program. When it runs, exit_code becomes 0 (all in order) or 2 (a file is refused).
void add_check(CLI::App& program, int& exit_code);

}  // namespace kphi::profiles
