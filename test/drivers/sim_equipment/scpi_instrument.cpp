#include "test/drivers/sim_equipment/scpi_instrument.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

namespace kphi::sim {
namespace {

constexpr std::size_t kLongestErrorQueue = 16;

void note(ScpiState& state, int code, const char* words) {
  if (state.errors.size() + 1 < kLongestErrorQueue) {
    state.errors.emplace_back(code, words);
  } else if (state.errors.size() < kLongestErrorQueue) {
    state.errors.emplace_back(-350, "Queue overflow");  // SCPI-99, 21.8.1
  }
}

char upper(char c) noexcept { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }

bool same(std::string_view a, std::string_view b) noexcept {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return upper(x) == upper(y); });
}

/// "VOLTage" is written VOLT or VOLTAGE (SCPI-99, 6.2.1), in any case.
bool names(std::string_view mnemonic, std::string_view written) noexcept {
  const auto small = std::find_if(mnemonic.begin(), mnemonic.end(), [](char c) { return c >= 'a' && c <= 'z'; });
  const auto shorter = static_cast<std::size_t>(small - mnemonic.begin());
  return same(mnemonic, written) || same(mnemonic.substr(0, shorter), written);
}

std::string_view next_node(std::string_view& path) noexcept {
  const std::size_t colon = path.find(':');
  const std::string_view node = path.substr(0, colon);
  path.remove_prefix(colon == std::string_view::npos ? path.size() : colon + 1);
  return node;
}

bool matches(std::string_view pattern, std::string_view header) noexcept {
  if (pattern.empty() || header.empty() || (pattern.back() == '?') != (header.back() == '?')) return false;
  if (pattern.back() == '?') pattern.remove_suffix(1), header.remove_suffix(1);
  while (!pattern.empty() && !header.empty())
    if (!names(next_node(pattern), next_node(header))) return false;
  return pattern.empty() && header.empty();
}

std::string_view trimmed(std::string_view text) noexcept {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

/// At the terminals of a supply: constant voltage until the limit of the current.
std::pair<double, double> given(const ScpiState& s) noexcept {
  if (!s.output) return {0, 0};
  const double amperes = std::min(s.voltage_v / s.load_ohm, s.current_a);
  return {amperes * s.load_ohm < s.voltage_v ? amperes * s.load_ohm : s.voltage_v, amperes};
}

bool limits_current(const ScpiState& s) noexcept { return s.output && s.voltage_v / s.load_ohm > s.current_a; }

struct Call {
  const ScpiType& type;
  ScpiState& state;
  std::string_view argument;
};

void set_within(const Call& call, double& value, double most) {
  if (same(call.argument, "MAX")) return void(value = most);
  if (same(call.argument, "MIN")) return void(value = 0);
  double wanted = 0;
  const char* const end = call.argument.data() + call.argument.size();
  const auto [stop, error] = std::from_chars(call.argument.data(), end, wanted);
  if (error != std::errc{} || stop != end) return note(call.state, -104, "Data type error");
  if (!(wanted >= 0 && wanted <= most)) return note(call.state, -222, "Data out of range");
  value = wanted;
}

void set_switch(const Call& call, bool& value) {
  if (same(call.argument, "ON") || call.argument == "1") return void(value = true);
  if (same(call.argument, "OFF") || call.argument == "0") return void(value = false);
  note(call.state, -104, "Data type error");
}

std::string told(const Call& call, double value, double most) {
  if (same(call.argument, "MAX")) value = most;
  if (same(call.argument, "MIN")) value = 0;
  return fmt::format("{:.3f}", value);
}

// Clauses that several rows share.
constexpr double kMargin = 1.1;  // of a threshold over the largest setting
double over_voltage_max(const Call& c) noexcept { return c.type.voltage_max_v * kMargin; }
double over_current_max(const Call& c) noexcept { return c.type.current_max_a * kMargin; }
std::string yes(const Call& c, bool value) {
  return c.type.family == ScpiFamily::rigol ? (value ? "YES" : "NO") : (value ? "1" : "0");
}

void clear_trips(ScpiState& s) { s.over_voltage_tripped = s.over_current_tripped = false; }

void reset(ScpiState& s) {
  ScpiState fresh;
  fresh.load_ohm = s.load_ohm;
  fresh.seen_voltage_v = s.seen_voltage_v;
  fresh.seen_current_a = s.seen_current_a;
  fresh.errors = s.errors;
  s = fresh;
}

std::string next_error(const Call& c) {
  std::pair<int, std::string> error{0, c.type.plain_errors ? "No Error" : "No error"};
  if (!c.state.errors.empty()) {
    error = c.state.errors.front();
    c.state.errors.pop_front();
  }
  return c.type.plain_errors ? fmt::format("{}  {}", error.first, error.second)
                             : fmt::format("{},\"{}\"", error.first, error.second);
}

std::string measured(const Call& c, double value) {
  return c.type.kind == ScpiKind::meter ? fmt::format("{:+.8E}", value) : fmt::format("{:.3f}", value);
}

double volts_of(const Call& c) noexcept {
  return c.type.kind == ScpiKind::meter ? c.state.seen_voltage_v : given(c.state).first;
}
double amperes_of(const Call& c) noexcept {
  return c.type.kind == ScpiKind::meter ? c.state.seen_current_a : given(c.state).second;
}

enum Who : unsigned { standard = 1, rigol = 2, meter = 4, supplies = standard | rigol, all = supplies | meter };

struct Row {
  std::string_view header;
  unsigned who;
  std::string (*apply)(const Call&);
};

#define ORDER(statement)             \
  [](const Call& c) -> std::string { \
    statement;                       \
    return {};                       \
  }
#define ANSWER(expression) [](const Call& c) -> std::string { return expression; }

const std::vector<Row>& rows() {
  static const std::vector<Row> table{
      {"*IDN?", all, ANSWER(c.type.identity)},
      {"*CLS", all, ORDER(c.state.errors.clear())},
      {"*RST", all, ORDER(reset(c.state))},
      {"*OPC?", all, [](const Call&) { return std::string("1"); }},
      {"SYSTem:ERRor?", all, ANSWER(next_error(c))},
      {"SYSTem:ERRor:NEXT?", all, ANSWER(next_error(c))},
      {"VOLTage", supplies, ORDER(set_within(c, c.state.voltage_v, c.type.voltage_max_v))},
      {"VOLTage?", supplies, ANSWER(told(c, c.state.voltage_v, c.type.voltage_max_v))},
      {"CURRent", supplies, ORDER(set_within(c, c.state.current_a, c.type.current_max_a))},
      {"CURRent?", supplies, ANSWER(told(c, c.state.current_a, c.type.current_max_a))},
      {"OUTPut", supplies, ORDER(clear_trips(c.state); set_switch(c, c.state.output))},
      {"OUTPut?", standard, ANSWER(c.state.output ? "1" : "0")},
      {"OUTPut?", rigol, ANSWER(c.state.output ? "ON" : "OFF")},
      {"MEASure:VOLTage?", all, ANSWER(measured(c, volts_of(c)))},
      {"MEASure:VOLTage:DC?", all, ANSWER(measured(c, volts_of(c)))},
      {"MEASure:CURRent?", all, ANSWER(measured(c, amperes_of(c)))},
      {"MEASure:CURRent:DC?", all, ANSWER(measured(c, amperes_of(c)))},
      {"MEASure:POWer?", all, ANSWER(measured(c, volts_of(c) * amperes_of(c)))},
      // SCPI-99
      {"VOLTage:PROTection", standard, ORDER(set_within(c, c.state.over_voltage_v, over_voltage_max(c)))},
      {"VOLTage:PROTection?", standard, ANSWER(told(c, c.state.over_voltage_v, over_voltage_max(c)))},
      {"VOLTage:PROTection:STATe", standard, ORDER(set_switch(c, c.state.over_voltage_armed))},
      {"VOLTage:PROTection:TRIPped?", standard, ANSWER(yes(c, c.state.over_voltage_tripped))},
      {"VOLTage:PROTection:CLEar", standard, ORDER(clear_trips(c.state))},
      {"CURRent:PROTection", standard, ORDER(set_within(c, c.state.over_current_a, over_current_max(c)))},
      {"CURRent:PROTection?", standard, ANSWER(told(c, c.state.over_current_a, over_current_max(c)))},
      {"CURRent:PROTection:STATe", standard, ORDER(set_switch(c, c.state.over_current_armed))},
      {"CURRent:PROTection:TRIPped?", standard, ANSWER(yes(c, c.state.over_current_tripped))},
      {"STATus:QUEStionable:CONDition?", standard, ANSWER(limits_current(c.state) ? "2" : "1")},
      // Rigol DP800 programming guide
      {"OUTPut:OVP:VALue", rigol, ORDER(set_within(c, c.state.over_voltage_v, over_voltage_max(c)))},
      {"OUTPut:OVP:VALue?", rigol, ANSWER(told(c, c.state.over_voltage_v, over_voltage_max(c)))},
      {"OUTPut:OVP", rigol, ORDER(set_switch(c, c.state.over_voltage_armed))},
      {"OUTPut:OVP:QUEStion?", rigol, ANSWER(yes(c, c.state.over_voltage_tripped))},
      {"OUTPut:OCP:VALue", rigol, ORDER(set_within(c, c.state.over_current_a, over_current_max(c)))},
      {"OUTPut:OCP:VALue?", rigol, ANSWER(told(c, c.state.over_current_a, over_current_max(c)))},
      {"OUTPut:OCP", rigol, ORDER(set_switch(c, c.state.over_current_armed))},
      {"OUTPut:OCP:QUEStion?", rigol, ANSWER(yes(c, c.state.over_current_tripped))},
      {"OUTPut:MODE?", rigol, ANSWER(limits_current(c.state) ? "CC" : "CV")},
  };
  return table;
}

#undef ORDER
#undef ANSWER

unsigned who_is(const ScpiType& type) noexcept {
  if (type.kind == ScpiKind::meter) return meter;
  return type.family == ScpiFamily::rigol ? rigol : standard;
}

}  // namespace

ScpiInstrument::ScpiInstrument(ScpiType type) : type_(std::move(type)) {}

std::string ScpiInstrument::apply(std::string_view message) {
  const std::lock_guard lock(mutex_);
  heard_.emplace_back(message);
  std::string answers;
  while (!message.empty()) {
    const std::size_t end = message.find(';');
    const std::string answer = obey_unit(trimmed(message.substr(0, end)));
    if (!answer.empty()) answers += (answers.empty() ? "" : ";") + answer;
    message.remove_prefix(end == std::string_view::npos ? message.size() : end + 1);
  }
  settle();
  return answers;
}

std::string ScpiInstrument::obey_unit(std::string_view unit) {
  if (unit.empty()) return {};
  if (unit.front() == ':') unit.remove_prefix(1);
  const std::size_t blank = unit.find_first_of(" \t");
  const std::string_view header = unit.substr(0, blank);
  const std::string_view argument = blank == std::string_view::npos ? "" : trimmed(unit.substr(blank));
  const bool power = matches("MEASure:POWer?", header);
  const bool status = matches("VOLTage:PROTection:TRIPped?", header) ||
                      matches("CURRent:PROTection:TRIPped?", header) ||
                      matches("STATus:QUEStionable:CONDition?", header);
  for (const Row& row : rows()) {
    if ((row.who & who_is(type_)) == 0 || !matches(row.header, header) || (power && !type_.measures_power) ||
        (status && !type_.tells_status))
      continue;
    return row.apply({type_, state_, argument});
  }
  note(state_, -113, "Undefined header");
  return {};
}

/// Protections act as soon as something has changed.
void ScpiInstrument::settle() {
  const auto [volts, amperes] = given(state_);
  if (state_.over_voltage_armed && volts > state_.over_voltage_v) state_.over_voltage_tripped = true;
  if (state_.over_current_armed && amperes > state_.over_current_a) state_.over_current_tripped = true;
  if (state_.over_voltage_tripped || state_.over_current_tripped) state_.output = false;
}

void ScpiInstrument::connect_load(double ohm) {
  const std::lock_guard lock(mutex_);
  state_.load_ohm = ohm;
  settle();
}

void ScpiInstrument::present(double volts, double amperes) {
  const std::lock_guard lock(mutex_);
  state_.seen_voltage_v = volts;
  state_.seen_current_a = amperes;
}

ScpiState ScpiInstrument::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::pair<double, double> ScpiInstrument::terminals() const {
  const std::lock_guard lock(mutex_);
  return given(state_);
}

std::vector<std::string> ScpiInstrument::heard() const {
  const std::lock_guard lock(mutex_);
  return heard_;
}

void ScpiInstrument::note_error(int code, const char* words) {
  const std::lock_guard lock(mutex_);
  note(state_, code, words);
}

}  // namespace kphi::sim
