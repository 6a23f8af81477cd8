// The options of every command that can be watched live.
#pragma once

#include <CLI/CLI.hpp>

#include "daq/live/live_session.hpp"

namespace kphi::commands {

/// Adds `--live [PORT]` and `--udp-json HOST:PORT`; `options` must outlive the command.
void add_live_options(CLI::App& command, daq::live::LiveOptions& options);

/// "live: http://…" as a line; empty without one.
[[nodiscard]] std::string live_greeting(const daq::live::LiveSession& view);

}  // namespace kphi::commands
