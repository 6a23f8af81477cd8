// The options of every command that can be looked on at.
#pragma once

#include <CLI/CLI.hpp>

#include "daq/live/view.hpp"

namespace kphi::daq::live {

/// Adds `--live [PORT]` and `--udp-json HOST:PORT`; `wishes` must outlive the command.
void add_options(CLI::App& command, Wishes& wishes);

/// "the page: http://…" as a line; empty without one.
[[nodiscard]] std::string greeting(const View& view);

}  // namespace kphi::daq::live
