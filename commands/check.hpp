// kphi check FILE… [--json]
#pragma once

namespace CLI {
class App;
}

namespace kphi::profiles {

/// Sets `exit_code` to 0 (all valid) or 2 (a file is refused).
void add_check(CLI::App& program, int& exit_code);

}  // namespace kphi::profiles
