// `kphi sim`: the simulated bench as a program, and commands to a running one.
#pragma once

namespace CLI {
class App;
}

namespace kphi::sim {

/// Exit code 0 after SIGINT or SIGTERM and for a granted --mount, 1 for a refused one.
void add_sim(CLI::App& program, int& exit_code);

}  // namespace kphi::sim
