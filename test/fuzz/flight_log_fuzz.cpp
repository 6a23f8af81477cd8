// libFuzzer: whatever the bytes are, the readers of flight logs refuse with one line or give channels whose times
// ascend and whose values are finite.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "fit/flights/flight_log.hpp"

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

void look_at(const kphi::fit::FlightChannel& channel) {
  require(channel.time_s.size() == channel.values.size());
  require(std::ranges::is_sorted(channel.time_s, std::ranges::less_equal{}));
  require(std::ranges::all_of(channel.values, [](double value) { return std::isfinite(value); }));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kphi::fit;
  static const FlightLayout told{{{FlightQuantity::time, 0, "t"},
                                  {FlightQuantity::arm_angle, 0, "actuator_servos.control[0]", 2, 1},
                                  {FlightQuantity::voltage, 0, "v"}}};
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  for (const FlightLayout& layout : {FlightLayout{}, told}) {
    try {
      const FlightLog log = parse_flight(bytes, "flight", layout);
      for (const auto* axes : {&log.specific_force, &log.angular_rate, &log.angular_acceleration})
        for (const FlightChannel& channel : *axes) look_at(channel);
      for (const auto* list : {&log.rotor_speed, &log.command, &log.arm_angle})
        for (const FlightChannel& channel : *list) look_at(channel);
      for (const FlightChannel* channel : {&log.voltage, &log.density, &log.height, &log.climb}) look_at(*channel);
    } catch (const kphi::ConfigurationError& error) {
      require(std::string_view(error.what()).find('\n') == std::string_view::npos);
    }
  }
  return 0;
}
