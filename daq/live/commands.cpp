#include "daq/live/commands.hpp"

#include <fmt/format.h>

#include <charconv>

namespace kphi::daq::live {

void add_options(CLI::App& command, Wishes& wishes) {
  // CLI11 hands on "true" for an option that was given without its value.
  const auto take_port = [&wishes](const std::string& text) {
    if (text.empty() || text == "true") {
      wishes.port = 0;
      return;
    }
    std::uint16_t port = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, port);
    if (error != std::errc() || stop != end) {
      throw CLI::ValidationError(
          "--live",
          fmt::format("\"{}\" is no port, 0 to 65535; without one put --live last, or before another option", text));
    }
    wishes.port = port;
  };
  command
      .add_option_function<std::string>("--live", take_port,
                                        "serve a page to look on, on 127.0.0.1; without PORT on any that is free")
      ->expected(0, 1)
      ->type_name("[PORT]");
  command.add_option("--udp-json", wishes.udp_json, "send every tick as a JSON datagram (PlotJuggler: 127.0.0.1:9870)")
      ->type_name("HOST:PORT");
}

std::string greeting(const View& view) {
  const std::string url = view.url();
  return url.empty() ? url : fmt::format("live: {}\n", url);
}

}  // namespace kphi::daq::live
