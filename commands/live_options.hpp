// The options of every command that can be watched live.
#pragma once

#include <CLI/CLI.hpp>

#include "daq/live/live_session.hpp"

namespace kphi::daq::live {

/// Adds `--live [PORT]` and `--udp-json HOST:PORT`; `wishes` must outlive the command.
void add_options(CLI::App& command, LiveOptions& wishes);

/// "the page: http://…" as a line; empty without one.
[[nodiscard]] std::string greeting(const LiveSession& view);

}  // namespace kphi::daq::live
