#include "drivers/scpi/scpi_supply.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "drivers/device_error.hpp"
#include "drivers/scpi/common_commands.hpp"
#include "drivers/scpi/numbers.hpp"

namespace kphi::scpi {
namespace {

constexpr double kMarginOfReading = 1.1;  // a supply shows a little more than it can be set to

void demand_range(const char* what, double value, double most) {
  if (std::isfinite(value) && value >= 0 && value <= most * kMarginOfReading) return;
  throw std::invalid_argument(fmt::format("{} {:g} is not within 0 and {:g}", what, value, most));
}

}  // namespace

ScpiSupply::ScpiSupply(Line& line, const Clock& clock) : line_(line), clock_(clock) {
  identity_.device = line.name();
  const std::string who = line_.query("*IDN?");
  const auto fields = identity_fields(who);
  if (fields[1].empty()) fail("*IDN?", "\"" + who + "\" names no model", "is this an instrument that speaks SCPI?");
  dialect_ = &dialect_of(who);
  identity_ = {fmt::format("supply {} on {}", fields[1], line.name()), fields[1], fields[2], fields[3]};
  forget_errors(line_);
  identity_.voltage_step_v = dialect_->voltage_step_v;
  identity_.current_step_a = dialect_->current_step_a;
  identity_.voltage_max_v = ask("VOLT? MAX");
  identity_.current_max_a = ask("CURR? MAX");
  if (identity_.voltage_max_v <= 0 || identity_.current_max_a <= 0)
    fail("VOLT? MAX", "it says that it gives nothing", "is this a supply?");
}

supply::Limits ScpiSupply::apply(const supply::Limits& limits) {
  demand_range("voltage", limits.voltage.value(), identity_.voltage_max_v);
  demand_range("current", limits.current.value(), identity_.current_max_a);
  demand_range("over-voltage threshold", limits.over_voltage.value(), identity_.voltage_max_v);
  demand_range("over-current threshold", limits.over_current.value(), identity_.current_max_a);
  const double v = identity_.voltage_step_v, a = identity_.current_step_a;
  set(dialect_->over_voltage, limits.over_voltage.value(), v);
  tell(std::string(dialect_->over_voltage_on));
  set(dialect_->over_current, limits.over_current.value(), a);
  tell(std::string(dialect_->over_current_on));
  set("CURR", limits.current.value(), a);
  set("VOLT", limits.voltage.value(), v);
  return {Volts(ask("VOLT?")), Amperes(ask("CURR?")), Volts(ask(std::string(dialect_->over_voltage) + "?")),
          Amperes(ask(std::string(dialect_->over_current) + "?"))};
}

supply::Reading ScpiSupply::read() {
  const Instant before = clock_.now();
  supply::Reading reading;
  reading.voltage_v = ask_within("MEAS:VOLT?", identity_.voltage_max_v);
  reading.current_a = ask_within("MEAS:CURR?", identity_.current_max_a);
  const Instant after = clock_.now();
  reading.at = before + (after - before) / 2;
  reading.uncertainty = (after - before) / 2;
  reading.set_voltage_v = ask_within("VOLT?", identity_.voltage_max_v);
  reading.current_limit_a = ask_within("CURR?", identity_.current_max_a);
  reading.output = ask("OUTP?") != 0;
  if (tripped(dialect_->over_voltage_tripped)) reading.protection = supply::Protection::over_voltage;
  if (tripped(dialect_->over_current_tripped)) reading.protection = supply::Protection::over_current;
  reading.regulation = regulation();
  return reading;
}

void ScpiSupply::switch_on() { switch_output(true); }
void ScpiSupply::switch_off() { switch_output(false); }

void ScpiSupply::switch_output(bool on) {
  tell(on ? "OUTP ON" : "OUTP OFF");
  if ((ask("OUTP?") != 0) != on) fail("OUTP", on ? "the output stays off" : "the output stays on", "switch it by hand");
}

supply::Counters ScpiSupply::counters() const noexcept {
  supply::Counters counters = counters_;
  const LineCounters line = line_.counters();
  counters.timeouts = line.timeouts;
  counters.damaged += line.damaged;
  counters.flushes = line.recoveries;
  return counters;
}

void ScpiSupply::tell(const std::string& command) {
  if (command.empty()) return;
  ++counters_.requests;
  line_.write(command);
  const std::string error = next_error(line_);
  if (error.empty()) return;
  ++counters_.refused;
  forget_errors(line_);
  fail(command, "the instrument answers " + error, "is this within what it can do?");
}

void ScpiSupply::set(std::string_view command, double value, double step) {
  tell(fmt::format("{} {}", command, number_text(value, step)));
}

double ScpiSupply::ask(std::string_view query) {
  ++counters_.requests;
  const std::string answer = line_.query(query);
  ++counters_.replies;
  // OUTP? answers 0 and 1, or ON and OFF.
  if (answer == "ON") return 1;
  if (answer == "OFF") return 0;
  if (const auto number = number_of(answer)) return *number;
  ++counters_.damaged;
  fail(query, "\"" + answer + "\" is no number");
}

double ScpiSupply::ask_within(std::string_view query, double most) {
  const double value = ask(query);
  // Converters show a few counts below zero.
  if (value >= -0.01 * most && value <= most * kMarginOfReading) return value;
  ++counters_.implausible;
  fail(query, fmt::format("{:g} cannot be: it gives at most {:g}", value, most));
}

bool ScpiSupply::tripped(std::string_view query) {
  if (query.empty()) return false;
  ++counters_.requests;
  const std::string answer = line_.query(query);
  ++counters_.replies;
  return answer == "1" || answer == "YES";
}

supply::Regulation ScpiSupply::regulation() {
  using supply::Regulation;
  if (dialect_->regulation.empty()) return Regulation::unknown;
  if (!dialect_->regulation_by_name) {
    const auto bits = static_cast<unsigned>(ask_within(dialect_->regulation, 32767 / kMarginOfReading));
    return (bits & 2u) != 0 ? Regulation::constant_current : Regulation::constant_voltage;
  }
  ++counters_.requests;
  const std::string answer = line_.query(dialect_->regulation);
  ++counters_.replies;
  if (answer == "CV") return Regulation::constant_voltage;
  return answer == "CC" ? Regulation::constant_current : Regulation::unknown;
}

void ScpiSupply::fail(std::string_view operation, const std::string& cause, const char* next_move) {
  throw DeviceError(identity_.device, std::string(operation), cause, next_move);
}

}  // namespace kphi::scpi
