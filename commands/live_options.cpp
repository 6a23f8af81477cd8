#include "commands/live_options.hpp"

#include <fmt/format.h>

#include "base/number.hpp"

namespace kphi::commands {

void add_live_options(CLI::App& command, daq::live::LiveOptions& options) {
  // CLI11 passes "true" for an option without its value.
  const auto take_port = [&options](const std::string& text) {
    if (text.empty() || text == "true") {
      options.port = 0;
      return;
    }
    options.port = parse_integer<std::uint16_t>(text);
    if (!options.port) {
      throw CLI::ValidationError(
          "--live", fmt::format("\"{}\" is not a port (0 to 65535); without a port, put --live last", text));
    }
  };
  command
      .add_option_function<std::string>("--live", take_port,
                                        "serve a live page on 127.0.0.1 (default PORT: any free one)")
      ->expected(0, 1)
      ->type_name("[PORT]");
  command
      .add_option("--udp-json", options.udp_json, "send every tick as a JSON datagram (PlotJuggler: 127.0.0.1:9870)")
      ->type_name("HOST:PORT");
}

std::string live_greeting(const daq::live::LiveSession& view) {
  const std::string url = view.url();
  return url.empty() ? url : fmt::format("live: {}\n", url);
}

}  // namespace kphi::commands
