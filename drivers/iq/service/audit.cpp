#include "drivers/iq/service/audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "compensation/units.hpp"

namespace kphi::iq {
namespace {

constexpr int kHobbyDisabled = 254;
constexpr double kNoDerate = 65536;
constexpr double kPolePairs = 7, kMotorKv = 2200, kMotorAmps = 30;  // 2306-2200Kv
constexpr double kSlowFilter = 8;                                   // Hz: a time constant as long as the loop's, 0.02 s
constexpr double kSlowSlew = 100;                                   // V/s; the manual advises not to go below

using Check = std::optional<Finding> (*)(const AuditRecord&, const Intention&);

Finding fault(std::string what, std::string next_move) {
  return {Severity::fault, std::move(what), std::move(next_move)};
}
Finding warning(std::string what, std::string next_move) {
  return {Severity::warning, std::move(what), std::move(next_move)};
}

int bits(const std::optional<double>& value) { return value && *value > 0 ? static_cast<int>(*value) : 0; }

/// Known, and below full scale.
bool derates(const std::optional<double>& value, double none) { return value && !(*value >= none); }

double supply_volts(const AuditRecord& module, const Intention& intention) {
  return std::max(intention.supply_voltage_max_v, module.value<"power_monitor.volts">().value_or(0));
}

std::optional<Finding> untold(const AuditRecord& module, const Intention&) {
  std::string missing;
  const auto need = [&](const char* name, bool told) {
    if (!told) missing += (missing.empty() ? "" : ", ") + std::string(name);
  };
  need("firmware_version", module.firmware().has_value());
  need("hardware_version", module.hardware().has_value());
  need("volts_limit", module.value<"brushless_drive.volts_limit">().has_value());
  need("timeout", module.value<"propeller_motor_control.timeout">().has_value());
  need("fault_now", module.value<"power_safety.fault_now">().has_value());
  if (missing.empty()) return std::nullopt;
  return fault("no answer from the module for " + missing,
               "check module id and wiring; update its firmware if it is old");
}

std::optional<Finding> other_module(const AuditRecord& module, const Intention& intention) {
  if (intention.uid.empty() || module.uid() == intention.uid) return std::nullopt;
  return fault(
      fmt::format("this is module {}, not {}", module.uid().empty() ? "of unknown uid" : module.uid(), intention.uid),
      "connect the intended module, or measure this one's clock gain and write it into the bench file");
}

std::optional<Finding> wrong_style(const AuditRecord& module, const Intention&) {
  const auto firmware = module.firmware();
  if (!firmware || firmware->style == FirmwareVersion::kSpeed) return std::nullopt;
  return fault(fmt::format("the firmware is {}, not a speed firmware", firmware->text()),
               "load speed firmware with the vendor's control program");
}

std::optional<Finding> wrong_hardware(const AuditRecord& module, const Intention&) {
  const auto board = module.hardware();
  if (!board || board->type == BoardVersion::kHardware2306) return std::nullopt;
  return fault(fmt::format("the hardware is {}, not a 2306 (type {})", board->text(), BoardVersion::kHardware2306),
               "connect the 2306-2200Kv module");
}

std::optional<Finding> wrong_electronics(const AuditRecord& module, const Intention&) {
  const auto board = module.electronics();
  if (!board || board->type == BoardVersion::kElectronics2306) return std::nullopt;
  return warning(
      fmt::format("the electronics are {}, a 2306 has type {}", board->text(), BoardVersion::kElectronics2306),
      "check that this is the intended module");
}

std::optional<Finding> old_firmware(const AuditRecord& module, const Intention&) {
  const auto firmware = module.firmware();
  const auto board = module.hardware();
  if (!firmware || !board || firmware->style != FirmwareVersion::kSpeed) return std::nullopt;
  const int lowest = board->major == 0 ? 30 : 32;
  if (!firmware->older_than(0, 0, lowest)) return std::nullopt;
  return warning(fmt::format("firmware {} is older than 0.0.{}", firmware->text(), lowest),
                 "update it with the vendor's control program");
}

std::optional<Finding> fault_now(const AuditRecord& module, const Intention&) {
  const int now = bits(module.value<"power_safety.fault_now">());
  if (now == 0) return std::nullopt;
  return fault("the module reports a fault: " + fault_words(now), "remove the cause; see the limits in power_safety");
}

std::optional<Finding> fault_before(const AuditRecord& module, const Intention&) {
  const int ever = bits(module.value<"power_safety.fault_ever">());
  if (ever == 0) return std::nullopt;
  if (bits(module.value<"power_safety.fault_latching">()) != 0)
    return fault("a fault is latched, the module stays in safe mode: " + fault_words(ever),
                 "find the cause, then set power_safety.fault_ever to 0 or power-cycle the module");
  return warning("fault recorded since fault_ever was last cleared: " + fault_words(ever),
                 "find the cause, then set power_safety.fault_ever to 0");
}

std::optional<Finding> not_latching(const AuditRecord& module, const Intention&) {
  const auto& latching = module.value<"power_safety.fault_latching">();
  if (!latching || *latching != 0) return std::nullopt;
  return warning("faults do not latch: after a fault the motor may restart by itself, again and again",
                 "set power_safety.fault_latching to 1 with the vendor's control program");
}

std::optional<Finding> low_volts_limit(const AuditRecord& module, const Intention& intention) {
  const auto& limit = module.value<"brushless_drive.volts_limit">();
  const double supply = supply_volts(module, intention);
  if (!limit || *limit > supply) return std::nullopt;
  return fault(fmt::format("volts_limit {:.4g} V is not above the supply's {:.4g} V: the motor may run away to its "
                           "maximum speed",
                           *limit, supply),
               "raise brushless_drive.volts_limit above the supply's maximum, but below what the supply survives");
}

std::optional<Finding> late_regeneration_limit(const AuditRecord& module, const Intention&) {
  const auto& start = module.value<"brushless_drive.v_max_start">();
  const auto& limit = module.value<"brushless_drive.volts_limit">();
  if (!start || !limit || *start <= *limit) return std::nullopt;
  return warning(fmt::format("v_max_start {:.4g} V is above volts_limit {:.4g} V: regeneration is not limited "
                             "gradually",
                             *start, *limit),
                 "set brushless_drive.v_max_start between the supply's voltage and volts_limit");
}

std::optional<Finding> low_input_limit(const AuditRecord& module, const Intention& intention) {
  const auto& high = module.value<"power_safety.volt_input_high">();
  const double supply = supply_volts(module, intention);
  if (!high || *high > supply) return std::nullopt;
  return warning(fmt::format("the module trips at {:.4g} V, the supply may reach {:.4g} V", *high, supply),
                 "lower the supply's voltage");
}

std::optional<Finding> long_timeout(const AuditRecord& module, const Intention& intention) {
  const auto& timeout = module.value<"propeller_motor_control.timeout">();
  if (!timeout || (*timeout > 0 && *timeout <= intention.timeout_max_s)) return std::nullopt;
  return fault(fmt::format("the communication timeout is {:.4g} s, the limit {:.4g} s: after a dead line the motor "
                           "would keep turning",
                           *timeout, intention.timeout_max_s),
               "set propeller_motor_control.timeout to 0.5");
}

std::optional<Finding> no_coast_at_timeout(const AuditRecord& module, const Intention&) {
  const auto& behavior = module.value<"propeller_motor_control.timeout_behavior">();
  if (bits(behavior) == static_cast<int>(TimeoutBehavior::coast)) return std::nullopt;
  return fault(
      "at its communication timeout the module drives 0 V, which feeds current into the supply, instead of coasting",
      "set propeller_motor_control.timeout_behavior to 0");
}

std::optional<Finding> no_coast_at_disarm(const AuditRecord& module, const Intention&) {
  const int meaning = bits(module.value<"propeller_motor_control.timeout_meaning">());
  if (meaning != static_cast<int>(TimeoutMeaning::disarm_behavior)) return std::nullopt;
  const auto& behavior = module.value<"arming_handler.disarm_behavior">();
  if (behavior && bits(behavior) == static_cast<int>(TimeoutBehavior::coast)) return std::nullopt;
  return fault("at its communication timeout the module runs its disarm behaviour, which does not coast",
               "set propeller_motor_control.timeout_meaning to 0, or arming_handler.disarm_behavior to 0");
}

std::optional<Finding> song(const AuditRecord& module, const Intention&) {
  if (bits(module.value<"propeller_motor_control.timeout_song_option">()) == static_cast<int>(SongOption::never))
    return std::nullopt;
  return warning("after a communication timeout the module plays its song, which shakes the load cell",
                 "set propeller_motor_control.timeout_song_option to 0");
}

std::optional<Finding> fixed_timeout_behavior(const AuditRecord& module, const Intention&) {
  if (module.value<"propeller_motor_control.timeout_behavior">()) return std::nullopt;
  return warning("old firmware: after a communication timeout it coasts and plays its song until it is commanded",
                 "update it with the vendor's control program");
}

std::optional<Finding> hobby_input(const AuditRecord& module, const Intention& intention) {
  const auto& allowed = module.value<"hobby_input.allowed_protocols">();
  if (!allowed || *allowed == kHobbyDisabled) return std::nullopt;
  Finding found = fault(fmt::format("the hobby input is enabled (allowed_protocols {:g}): noise on it can command the "
                                    "motor",
                                    *allowed),
                        "set hobby_input.allowed_protocols to 254 with the vendor's control program");
  if (intention.hobby_input_allowed) found.severity = Severity::warning;
  return found;
}

std::optional<Finding> other_pole_pairs(const AuditRecord& module, const Intention&) {
  const auto& pairs = module.value<"brushless_drive.motor_pole_pairs">();
  if (!pairs || *pairs == kPolePairs) return std::nullopt;
  return warning(fmt::format("motor_pole_pairs is {:g}, a 2306 has {:g}: reported speeds would be wrong by their ratio",
                             *pairs, kPolePairs),
                 "correct brushless_drive.motor_pole_pairs with the vendor's control program");
}

std::optional<Finding> other_kv(const AuditRecord& module, const Intention&) {
  const auto& kv = module.value<"brushless_drive.motor_Kv">();
  if (!kv || std::abs(*kv / kMotorKv - 1) <= 0.1) return std::nullopt;
  return warning(fmt::format("motor_Kv is {:.4g} RPM/V, a 2306-2200Kv has {:g}: estimated currents and limits are off",
                             *kv, kMotorKv),
                 "correct brushless_drive.motor_Kv with the vendor's control program");
}

std::optional<Finding> high_current(const AuditRecord& module, const Intention&) {
  const auto& amps = module.value<"brushless_drive.motor_I_max">();
  if (!amps || *amps <= kMotorAmps) return std::nullopt;
  return warning(fmt::format("motor_I_max is {:.4g} A; above {:g} A the motor overheats", *amps, kMotorAmps),
                 "lower brushless_drive.motor_I_max");
}

std::optional<Finding> low_redline(const AuditRecord& module, const Intention& intention) {
  const auto& start = module.value<"brushless_drive.motor_redline_start">();
  if (!start || intention.speed_max_rad_s <= 0 || *start > intention.speed_max_rad_s) return std::nullopt;
  return warning(fmt::format("the module derates above {:.4g} rad/s (redline), the fastest step needs {:.4g} rad/s",
                             *start, intention.speed_max_rad_s),
                 "lower the top speed, or raise brushless_drive.motor_redline_start");
}

std::optional<Finding> low_coil_limit(const AuditRecord& module, const Intention& intention) {
  const auto& warm = module.value<"coil_temperature_estimator.otw">();
  if (!warm || intention.coil_temperature_max_degc <= 0 || *warm >= intention.coil_temperature_max_degc)
    return std::nullopt;
  return warning(fmt::format("the module derates above a coil temperature of {:.4g} °C, the limit is {:.4g} °C", *warm,
                             intention.coil_temperature_max_degc),
                 "lower the coil temperature limit to that value");
}

std::optional<Finding> hot(const AuditRecord& module, const Intention&) {
  if (!derates(module.value<"temperature_monitor_uc.derate">(), 1) &&
      !derates(module.value<"coil_temperature_estimator.derate">(), 1) &&
      !derates(module.value<"temperature_estimator.derate">(), kNoDerate) &&
      !derates(module.value<"brushless_drive.derate">(), kNoDerate))
    return std::nullopt;
  return warning("the module already derates, with the motor at rest", "let it cool down");
}

std::optional<Finding> no_coil_temperature(const AuditRecord& module, const Intention&) {
  switch (module.coil_temperature_client()) {
    case 0:
      return warning("no coil temperature from the module: nothing guards the coil", "update the firmware");
    case 77:
      return Finding{Severity::note, "old firmware: coil temperature from temperature_estimator", ""};
    default:
      return std::nullopt;
  }
}

std::optional<Finding> slewing(const AuditRecord& module, const Intention&) {
  const auto& slew = module.value<"brushless_drive.slew_volts_per_second">();
  if (bits(module.value<"brushless_drive.slew_enable">()) == 0 || !slew) return std::nullopt;
  const bool slow = !(*slew >= kSlowSlew);
  return Finding{slow ? Severity::warning : Severity::note,
                 fmt::format("the drive voltage is limited to {:.4g} V/s: steps settle later", *slew),
                 slow ? "raise brushless_drive.slew_volts_per_second to 100 or more" : ""};
}

std::optional<Finding> late_commands(const AuditRecord& module, const Intention&) {
  const auto& hertz = module.value<"propeller_motor_control.input_filter_fc">();
  if (!hertz || *hertz >= kSlowFilter) return std::nullopt;
  return warning(fmt::format("input_filter_fc is {:g} Hz: a new speed reaches the controller only after {:.2g} s",
                             *hertz, 1 / (2 * kPi * *hertz)),
                 "raise propeller_motor_control.input_filter_fc to 10 Hz or more");
}

std::optional<Finding> no_control(const AuditRecord& module, const Intention&) {
  const auto& kp = module.value<"propeller_motor_control.velocity_Kp">();
  const auto& ki = module.value<"propeller_motor_control.velocity_Ki">();
  if (!kp || !ki || *kp > 0 || *ki > 0) return std::nullopt;
  return warning("velocity_Kp and velocity_Ki are 0: the speed is not controlled", "tune the controller");
}

std::optional<Finding> no_feed_forward(const AuditRecord& module, const Intention&) {
  std::string unset;
  const auto look = [&](const char* name, const std::optional<double>& value) {
    if (value && !(*value > 0)) unset += (unset.empty() ? "" : " and ") + std::string(name);
  };
  look("velocity_ff1", module.value<"propeller_motor_control.velocity_ff1">());
  look("velocity_ff2", module.value<"propeller_motor_control.velocity_ff2">());
  if (unset.empty()) return std::nullopt;
  return warning(unset + " is unset: steps settle late or never",
                 "identify it for this propeller: V = ff1 w + ff2 w^2, ff2 is near 3e-7 for 5 inches");
}

std::optional<Finding> unchecked_clock(const AuditRecord&, const Intention& intention) {
  if (!intention.clock_unchecked) return std::nullopt;
  return Finding{Severity::note, "the module's clock is unchecked: its speeds may be off by some tenths of a percent",
                 "kphi devices --bench FILE --clock-gain measures it"};
}

constexpr Check kChecks[] = {untold,
                             other_module,
                             wrong_style,
                             wrong_hardware,
                             fault_now,
                             fault_before,
                             low_volts_limit,
                             long_timeout,
                             no_coast_at_timeout,
                             no_coast_at_disarm,
                             hobby_input,
                             wrong_electronics,
                             old_firmware,
                             fixed_timeout_behavior,
                             other_pole_pairs,
                             other_kv,
                             low_input_limit,
                             not_latching,
                             late_regeneration_limit,
                             song,
                             no_coil_temperature,
                             hot,
                             low_redline,
                             low_coil_limit,
                             high_current,
                             no_control,
                             no_feed_forward,
                             slewing,
                             late_commands,
                             unchecked_clock};

std::string value_text(const Entry& entry, double value) {
  return entry.format == Format::f32 ? fmt::format("{}", static_cast<float>(value)) : fmt::format("{:.0f}", value);
}

}  // namespace

std::optional<FirmwareVersion> AuditRecord::firmware() const noexcept {
  const auto& word = value<"system_control.firmware_version">();
  return word ? std::optional(FirmwareVersion(static_cast<std::uint32_t>(*word))) : std::nullopt;
}

std::optional<BoardVersion> AuditRecord::hardware() const noexcept {
  const auto& word = value<"system_control.hardware_version">();
  return word ? std::optional(BoardVersion(static_cast<std::uint32_t>(*word))) : std::nullopt;
}

std::optional<BoardVersion> AuditRecord::electronics() const noexcept {
  const auto& word = value<"system_control.electronics_version">();
  return word ? std::optional(BoardVersion(static_cast<std::uint32_t>(*word))) : std::nullopt;
}

std::string AuditRecord::uid() const {
  const auto& a = value<"system_control.uid1">();
  const auto& b = value<"system_control.uid2">();
  const auto& c = value<"system_control.uid3">();
  if (!a || !b || !c) return "";
  return fmt::format("{:08x}{:08x}{:08x}", static_cast<std::uint32_t>(*a), static_cast<std::uint32_t>(*b),
                     static_cast<std::uint32_t>(*c));
}

int AuditRecord::coil_temperature_client() const noexcept {
  if (value<"coil_temperature_estimator.t_coil">()) return static_cast<int>(Client::coil_temperature_estimator);
  return value<"temperature_estimator.temp">() ? static_cast<int>(Client::temperature_estimator) : 0;
}

std::string AuditRecord::text() const {
  std::string text;
  const auto decoded = [&](const char* name, const std::string& words) {
    if (!words.empty()) text += fmt::format("{}: {}\n", name, words);
  };
  decoded("uid", uid().empty() ? "" : '"' + uid() + '"');
  decoded("firmware", firmware() ? firmware()->text() : "");
  decoded("hardware", hardware() ? hardware()->text() : "");
  decoded("electronics", electronics() ? electronics()->text() : "");
  for (std::size_t i = 0; i < kAuditedCount; ++i) {
    if (!values[i]) continue;
    const Entry& told = *kAudited[i];
    text += fmt::format("{}.{}: {}{}{}\n", name_of(told.type), told.name, value_text(told, *values[i]),
                        told.unit.empty() ? "" : "  # ", told.unit);
  }
  return text;
}

AuditRecord AuditRecord::of(std::string_view text) {
  AuditRecord record;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const std::size_t colon = line.find(": ");
    if (colon == std::string_view::npos) continue;
    double value = 0;
    if (std::from_chars(line.data() + colon + 2, line.data() + line.size(), value).ec != std::errc()) continue;
    for (std::size_t i = 0; i < kAuditedCount; ++i) {
      if (line.substr(0, colon) == fmt::format("{}.{}", name_of(kAudited[i]->type), kAudited[i]->name))
        record.values[i] = value;
    }
  }
  return record;
}

AuditRecord read_audit(Dialogue& module) {
  AuditRecord record;
  std::optional<Client> absent;
  for (std::size_t i = 0; i < kAuditedCount; ++i) {
    const Entry& asked = *kAudited[i];
    const bool first = i == 0 || kAudited[i - 1]->type != asked.type;
    const bool succeeded =
        asked.type == Client::temperature_estimator && record.value<"coil_temperature_estimator.t_coil">().has_value();
    if (succeeded || asked.type == absent) continue;
    if (const auto answer = module.ask(asked)) {
      record.values[i] = answer->value;
    } else if (first) {
      absent = asked.type;
    }
  }
  return record;
}

std::vector<Finding> audit(const AuditRecord& module, const Intention& intention) {
  std::vector<Finding> findings;
  for (const Check check : kChecks) {
    if (auto finding = check(module, intention)) findings.push_back(std::move(*finding));
  }
  put_worst_first(findings);
  return findings;
}

std::string fault_words(int bits) {
  constexpr const char* names[] = {
      "under-voltage of the logic", "input voltage",   "reference voltage", "supply current", "motor current",
      "controller temperature",     "coil temperature"};
  std::string words;
  for (int bit = 0; bit < 8; ++bit) {
    if ((bits >> bit & 1) == 0) continue;
    words += (words.empty() ? "" : ", ") +
             (bit < static_cast<int>(std::size(names)) ? std::string(names[bit]) : fmt::format("bit {}", bit));
  }
  return words;
}

}  // namespace kphi::iq
