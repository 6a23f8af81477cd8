#include "drivers/scpi/scpi_supply.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "base/error.hpp"
#include "drivers/scpi/wire.hpp"

namespace kphi::scpi {
namespace {

constexpr const char* kOff = "OUTP OFF";

constexpr double kMarginOfReading = 1.1;  // a supply shows a little more than it can be set to
constexpr int kLongestQueue = 64;         // of errors; real ones hold 10 to 32
constexpr double kStep = 0.001;           // V and A

/// Some makers answer `0  No Error`, without the comma of SCPI-99 (21.8). nullopt: it begins with no number.
std::optional<double> error_code(std::string_view error) {
  error.remove_prefix(std::min(error.find_first_not_of(" \t"), error.size()));
  return number_of(error.substr(0, error.find_first_of(", \t")));
}

void demand_range(const char* what, double value, double most) {
  if (std::isfinite(value) && value >= 0 && value <= most * kMarginOfReading) return;
  throw std::invalid_argument(fmt::format("{} {:g} is not within 0 to {:g}", what, value, most));
}

}  // namespace

/// The commands of one maker's family of supplies, without their argument.
struct ScpiSupply::Dialect {
  std::string_view identity;         ///< part of *IDN?; empty: any
  std::string_view over_voltage;     ///< threshold
  std::string_view over_voltage_on;  ///< whole command that arms it
  std::string_view over_current;
  std::string_view over_current_on;
  std::string_view over_voltage_tripped;  ///< query; answers 1 or YES
  std::string_view over_current_tripped;
  std::string_view regulation;  ///< query
  /// True: `regulation` answers CV, CC or UR. False: bits of the questionable status (SCPI-99, 20.3): bit 1 = current
  /// is what is held.
  bool regulation_by_name = false;
};

/// The first whose pattern is part of the answer to *IDN?.
const ScpiSupply::Dialect& ScpiSupply::dialect_of(std::string_view identity) noexcept {
  // SCPI-99 volume 2 for the last row; the makers' programming guides for the others.
  static constexpr Dialect kDialects[] = {
      {"RIGOL TECHNOLOGIES,DP8", "OUTP:OVP:VAL", "OUTP:OVP ON", "OUTP:OCP:VAL", "OUTP:OCP ON", "OUTP:OVP:QUES?",
       "OUTP:OCP:QUES?", "OUTP:MODE?", true},
      {"", "VOLT:PROT", "VOLT:PROT:STAT ON", "CURR:PROT", "CURR:PROT:STAT ON", "VOLT:PROT:TRIP?", "CURR:PROT:TRIP?",
       "STAT:QUES:COND?", false},
  };
  return *std::find_if(std::begin(kDialects), std::end(kDialects) - 1, [&](const Dialect& dialect) {
    return identity.find(dialect.identity) != std::string_view::npos;
  });
}

ScpiSupply::ScpiSupply(std::unique_ptr<Line> line, const Clock& clock) : line_(std::move(line)), clock_(clock) {
  identity_.device = line_->name();
  const std::string who = line_->query("*IDN?");
  const auto fields = identity_fields(who);
  if (fields[1].empty()) fail("*IDN?", "\"" + who + "\" does not name a model", "check that this is a SCPI instrument");
  dialect_ = &dialect_of(who);
  identity_ = {fmt::format("supply {} on {}", fields[1], line_->name()), fields[1], fields[2], fields[3]};
  identity_.off = line_->last_word(kOff, "OUTP?", identity_.device);
  if (identity_.off && !identity_.off->question.empty()) identity_.off->proofs = {"0\n", "0\r", "OFF"};
  forget_errors();
  over_voltage_tripped_ = known(dialect_->over_voltage_tripped);
  over_current_tripped_ = known(dialect_->over_current_tripped);
  regulation_ = known(dialect_->regulation);
  if (!identity_.untold.empty()) forget_errors();
  identity_.voltage_max_v = ask("VOLT? MAX");
  identity_.current_max_a = ask("CURR? MAX");
  if (identity_.voltage_max_v <= 0 || identity_.current_max_a <= 0)
    fail("VOLT? MAX", "reports a maximum of 0 V or 0 A", "check that this is a power supply");
}

supply::Limits ScpiSupply::apply(const supply::Limits& limits) {
  demand_range("voltage", limits.voltage.value(), identity_.voltage_max_v);
  demand_range("current", limits.current.value(), identity_.current_max_a);
  demand_range("over-voltage threshold", limits.over_voltage.value(), identity_.voltage_max_v);
  demand_range("over-current threshold", limits.over_current.value(), identity_.current_max_a);
  set(dialect_->over_voltage, limits.over_voltage.value());
  tell(std::string(dialect_->over_voltage_on));
  set(dialect_->over_current, limits.over_current.value());
  tell(std::string(dialect_->over_current_on));
  set("CURR", limits.current.value());
  set("VOLT", limits.voltage.value());
  return {Volts(ask("VOLT?")), Amperes(ask("CURR?")), Volts(ask(std::string(dialect_->over_voltage) + "?")),
          Amperes(ask(std::string(dialect_->over_current) + "?"))};
}

SupplyReading ScpiSupply::read(const std::function<void()>& between) {
  const Instant before = clock_.now();
  SupplyReading reading;
  reading.voltage_v = ask_within("MEAS:VOLT?", identity_.voltage_max_v);
  between();
  reading.current_a = ask_within("MEAS:CURR?", identity_.current_max_a);
  const Instant after = clock_.now();
  reading.time_ns = (before + (after - before) / 2).count();
  reading.uncertainty_ns = ((after - before) / 2).count();
  between();
  reading.output = ask("OUTP?") != 0;
  between();
  reading.set_voltage_v = ask_within("VOLT?", identity_.voltage_max_v);
  between();
  reading.current_limit_a = ask_within("CURR?", identity_.current_max_a);
  between();
  if (tripped(over_voltage_tripped_)) reading.protection = SupplyProtection::over_voltage;
  between();
  if (tripped(over_current_tripped_)) reading.protection = SupplyProtection::over_current;
  between();
  reading.regulation = regulation();
  return reading;
}

/// The output's own state decides; the queue of errors only says why it does not obey.
void ScpiSupply::switch_output(bool on) {
  line_->write(on ? "OUTP ON" : kOff);
  if ((ask("OUTP?") != 0) == on) return;
  const std::string error = next_error();
  fail("OUTP",
       (on ? "the output stays off" : "the output stays on") +
           (error.empty() ? "" : ": the instrument answers " + error),
       "switch it by hand");
}

/// The oldest error in the instrument's queue, taken out of it; empty: none. Errors of the conversation (-400 to -499:
/// a query interrupted or not fetched) blame no command and are skipped.
std::string ScpiSupply::next_error() {
  std::string error;
  for (int i = 0; i < kLongestQueue; ++i) {
    error = line_->query("SYST:ERR?");
    const auto code = error_code(error);
    if (code && *code == 0) return {};
    if (!code || *code > -400 || *code < -499) break;
  }
  return error;
}

/// Empties the queue, so that no command is blamed for older errors.
void ScpiSupply::forget_errors() {
  for (int i = 0; i < kLongestQueue && !next_error().empty(); ++i) {
  }
}

void ScpiSupply::tell(const std::string& command) {
  line_->write(command);
  const std::string error = next_error();
  if (error.empty()) return;
  forget_errors();
  fail(command, "the instrument answers " + error, "check the ranges of the instrument");
}

void ScpiSupply::set(std::string_view command, double value) {
  tell(fmt::format("{} {}", command, number_text(value, kStep)));
}

double ScpiSupply::ask(std::string_view command) {
  const std::string answer = line_->query(command);
  // OUTP? answers 0 and 1, or ON and OFF.
  if (answer == "ON") return 1;
  if (answer == "OFF") return 0;
  if (const auto number = number_of(answer)) return *number;
  fail(command, "\"" + answer + "\" is not a number");
}

double ScpiSupply::ask_within(std::string_view command, double most) {
  const double value = ask(command);
  // Converters show a few counts below zero.
  if (value >= -0.01 * most && value <= most * kMarginOfReading) return value;
  fail(command, fmt::format("reading {:g} is impossible: its maximum is {:g}", value, most));
}

/// The query, or nothing if the instrument has none such: then no answer comes, and its queue has a command error
/// (SCPI-99, 21.8.9: -100 to -199). Without one it was slow, or is gone.
std::string_view ScpiSupply::known(std::string_view query) {
  try {
    (void)line_->query(query);
    return query;
  } catch (const DeviceError&) {
    const auto code = error_code(next_error());
    if (!code || *code > -100 || *code < -199) throw;
    identity_.untold += (identity_.untold.empty() ? "" : ", ") + std::string(query);
    return {};
  }
}

bool ScpiSupply::tripped(std::string_view command) {
  if (command.empty()) return false;
  const std::string answer = line_->query(command);
  return answer == "1" || answer == "YES";
}

SupplyRegulation ScpiSupply::regulation() {
  if (regulation_.empty()) return SupplyRegulation::unknown;
  if (!dialect_->regulation_by_name) {
    const auto bits = static_cast<unsigned>(ask_within(regulation_, 32767 / kMarginOfReading));
    return (bits & 2u) != 0 ? SupplyRegulation::constant_current : SupplyRegulation::constant_voltage;
  }
  const std::string answer = line_->query(regulation_);
  if (answer == "CV") return SupplyRegulation::constant_voltage;
  return answer == "CC" ? SupplyRegulation::constant_current : SupplyRegulation::unknown;
}

void ScpiSupply::fail(std::string_view operation, const std::string& cause, const char* next_move) {
  throw DeviceError(identity_.device, std::string(operation), cause, next_move);
}

}  // namespace kphi::scpi
