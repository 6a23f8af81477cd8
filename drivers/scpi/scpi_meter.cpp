#include "drivers/scpi/scpi_meter.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "drivers/device_error.hpp"
#include "drivers/scpi/common_commands.hpp"
#include "drivers/scpi/numbers.hpp"

namespace kphi::scpi {

ScpiMeter::ScpiMeter(Line& line, const Clock& clock, const Quantities& quantities)
    : line_(line), clock_(clock), quantities_(quantities), identity_("meter on " + line.name()) {
  if (!quantities.voltage && !quantities.current && !quantities.power)
    throw std::invalid_argument("a meter that is asked for nothing");
  const auto fields = identity_fields(line_.query("*IDN?"));
  if (fields[1].empty())
    throw DeviceError(identity_, "*IDN?", "it names no model", "is this an instrument that speaks SCPI?");
  identity_ = fmt::format("meter {} on {}", fields[1], line.name());
  forget_errors(line_);
  (void)read();
}

MeterReading ScpiMeter::read() {
  MeterReading reading;
  const Instant before = clock_.now();
  if (quantities_.voltage) reading.voltage_v = measure("MEAS:VOLT?");
  if (quantities_.current) reading.current_a = measure("MEAS:CURR?");
  if (quantities_.power) reading.power_w = measure("MEAS:POW?");
  const Instant after = clock_.now();
  reading.at = before + (after - before) / 2;
  reading.uncertainty = (after - before) / 2;
  return reading;
}

double ScpiMeter::measure(const char* query) {
  const std::string answer = line_.query(query);
  if (const auto value = number_of(answer)) return *value;
  throw DeviceError(identity_, query, "\"" + answer + "\" is no number",
                    answer.find("E+37") != std::string::npos ? "the input is beyond its range" : "");
}

}  // namespace kphi::scpi
