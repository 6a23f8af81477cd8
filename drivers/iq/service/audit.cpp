#include "drivers/iq/service/audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "compensation/units.hpp"

namespace kphi::iq {
namespace {

constexpr int kHobbyDisabled = 254;
constexpr double kLongestTimeout = 1;  // s
constexpr double kNoDerate = 65536;
constexpr double kPolePairs = 7, kMotorKv = 2200, kMotorAmps = 30;  // 2306-2200Kv
constexpr double kSlowFilter = 8;                                   // Hz: a time constant as long as the loop's, 0.02 s
constexpr double kSlowSlew = 100;                                   // V/s; the manual advises not to go below

int bits(const std::optional<double>& value) { return value && *value > 0 ? static_cast<int>(*value) : 0; }

bool is(const std::optional<double>& value, auto code) { return bits(value) == static_cast<int>(code); }

/// Known, and below full scale.
bool derates(const std::optional<double>& value, double none) { return value && !(*value >= none); }

/// The checks, by theme. An unknown value is not checked, except where unanswered() demands it.
class Checks {
 public:
  Checks(const AuditRecord& module, const Intention& intention)
      : module_(module),
        intention_(intention),
        supply_volts_(std::max(intention.supply_voltage_max_v, value<"power_monitor.volts">().value_or(0))) {}

  std::vector<Finding> all() {
    unanswered();
    other_module();
    firmware();
    hardware();
    faults();
    voltages();
    communication_timeout();
    disarming();
    other_inputs();
    motor();
    controller();
    slewing();
    put_worst_first(findings_);
    return std::move(findings_);
  }

 private:
  template <Path path>
  [[nodiscard]] std::optional<double> value() const {
    return module_.value<path>();
  }
  void fault(std::string what, std::string next_move) {
    findings_.push_back({Severity::fault, std::move(what), std::move(next_move)});
  }
  void warn(std::string what, std::string next_move) {
    findings_.push_back({Severity::warning, std::move(what), std::move(next_move)});
  }
  void note(std::string what, std::string next_move = "") {
    findings_.push_back({Severity::note, std::move(what), std::move(next_move)});
  }

  void unanswered() {
    std::vector<const char*> missing;
    const auto need = [&](const char* name, bool answered, const char* without = "", const char* consequence = "") {
      if (answered) return;
      if (std::ranges::find(intention_.accepted_without, without) == intention_.accepted_without.end())
        return missing.push_back(name);
      warn(fmt::format("no answer from the module for {}, accepted by accept_without in the bench file: {}", name,
                       consequence),
           "");
    };
    need("firmware_version", module_.firmware().has_value());
    need("hardware_version", module_.hardware().has_value());
    need("volts_limit", value<"brushless_drive.volts_limit">().has_value(), kMayLack[1],
         "a supply above it would let the motor run away to its maximum speed");
    need("timeout", value<"propeller_motor_control.timeout">().has_value());
    need("fault_now", value<"power_safety.fault_now">().has_value(), kMayLack[0],
         "the module tells none of its faults, and kphi's own limits are all that holds");
    if (!missing.empty())
      fault(
          fmt::format("no answer from the module for {}", fmt::join(missing, ", ")),
          "check module id and wiring; update its firmware if it is old, or accept what may be lacking (power_safety, "
          "volts_limit) by name: iq.accept_without");
    lacking();
  }

  /// Everything that was asked and not answered, once: a client by its name if none of its entries was.
  void lacking() {
    const int coil = module_.coil_temperature_client();
    std::map<std::string, std::pair<std::vector<std::string>, bool>> clients;  // entries missing; whether one answered
    for (const Entry& entry : kEntries) {
      const bool other_coil =
          (entry.type == Client::temperature_estimator || entry.type == Client::coil_temperature_estimator) &&
          static_cast<int>(entry.type) != coil;
      if (!entry.audited || (other_coil && coil != 0)) continue;
      const std::string path(entry.path);
      auto& [absent, answered] = clients[path.substr(0, path.find('.'))];
      if (module_.values.contains(&entry))
        answered = true;
      else
        absent.push_back(path);
    }
    std::vector<std::string> names;
    for (const auto& [client, found] : clients) {
      if (!found.second && !found.first.empty()) names.push_back(client);
      if (found.second) names.insert(names.end(), found.first.begin(), found.first.end());
    }
    if (!names.empty() && names.size() < clients.size())
      note(fmt::format("this firmware does not know {}: what hangs on that is not checked", fmt::join(names, ", ")));
  }

  void other_module() {
    const std::string uid = module_.uid();
    if (intention_.uid.empty() || uid == intention_.uid) return;
    fault(fmt::format("this is module {}, not {}", uid.empty() ? "of unknown uid" : uid, intention_.uid),
          "connect the intended module, or measure this one's clock gain and write it into the bench file");
  }

  void firmware() {
    const auto found = module_.firmware();
    if (!found) return;
    if (found->style != FirmwareVersion::kSpeed)
      return fault(fmt::format("the firmware is {}, not a speed firmware", found->text()),
                   "load speed firmware with the vendor's control program");
    const auto board = module_.hardware();
    const int lowest = board && board->major == 0 ? 30 : 32;
    if (board && found->older_than(0, 0, lowest))
      warn(fmt::format("firmware {} is older than 0.0.{}", found->text(), lowest),
           "update it with the vendor's control program");
  }

  void hardware() {
    const auto board = module_.hardware(), electronics = module_.electronics();
    if (board && board->type != BoardVersion::kHardware2306)
      fault(fmt::format("the hardware is {}, not a 2306 (type {})", board->text(), BoardVersion::kHardware2306),
            "connect the 2306-2200Kv module");
    if (electronics && electronics->type != BoardVersion::kElectronics2306)
      warn(fmt::format("the electronics are {}, a 2306 has type {}", electronics->text(),
                       BoardVersion::kElectronics2306),
           "check that this is the intended module");
  }

  void faults() {
    const int now = bits(value<"power_safety.fault_now">()), ever = bits(value<"power_safety.fault_ever">());
    const auto latching = value<"power_safety.fault_latching">();
    if (now != 0)
      fault("the module reports a fault: " + fault_words(now), "remove the cause; see the limits in power_safety");
    if (ever != 0 && bits(latching) != 0)
      fault("a fault is latched, the module stays in safe mode: " + fault_words(ever),
            "find the cause, then set power_safety.fault_ever to 0 or power-cycle the module");
    if (ever != 0 && bits(latching) == 0)
      warn("fault recorded since fault_ever was last cleared: " + fault_words(ever),
           "find the cause, then set power_safety.fault_ever to 0");
    if (latching && *latching == 0)
      warn("faults do not latch: after a fault the motor may restart by itself, again and again",
           "set power_safety.fault_latching to 1 with the vendor's control program");
  }

  void voltages() {
    const auto limit = value<"brushless_drive.volts_limit">();
    const auto high = value<"power_safety.volt_input_high">();
    if (limit && !(*limit > supply_volts_))
      fault(
          fmt::format("volts_limit {:.4g} V is not above the supply's {:.4g} V: the motor may run away to its maximum "
                      "speed",
                      *limit, supply_volts_),
          "raise brushless_drive.volts_limit above the supply's maximum, but below what the supply survives");
    if (high && !(*high > supply_volts_))
      warn(fmt::format("the module trips at {:.4g} V, the supply may reach {:.4g} V", *high, supply_volts_),
           "lower the supply's voltage");
    const auto start = value<"brushless_drive.v_max_start">();
    if (start && limit && !(*start <= *limit))
      warn(fmt::format("v_max_start {:.4g} V is above volts_limit {:.4g} V: regeneration is not limited gradually",
                       *start, *limit),
           "set brushless_drive.v_max_start between the supply's voltage and volts_limit");
  }

  void communication_timeout() {
    const auto timeout = value<"propeller_motor_control.timeout">();
    if (timeout && !(*timeout > 0 && *timeout <= kLongestTimeout))
      fault(fmt::format("the communication timeout is {:.4g} s, the limit {:.4g} s: after a dead line the motor would "
                        "keep turning",
                        *timeout, kLongestTimeout),
            "set propeller_motor_control.timeout to 0.5");
    if (!is(value<"propeller_motor_control.timeout_behavior">(), TimeoutBehavior::coast))
      fault(
          "at its communication timeout the module drives 0 V, which feeds current into the supply, instead of "
          "coasting",
          "set propeller_motor_control.timeout_behavior to 0");
    if (!value<"propeller_motor_control.timeout_behavior">())
      warn("old firmware: after a communication timeout it coasts and plays its song until it is commanded",
           "update it with the vendor's control program");
    if (!is(value<"propeller_motor_control.timeout_song_option">(), SongOption::never))
      warn("after a communication timeout the module plays its song, which shakes the load cell",
           "set propeller_motor_control.timeout_song_option to 0");
  }

  void disarming() {
    if (!is(value<"propeller_motor_control.timeout_meaning">(), TimeoutMeaning::disarm_behavior)) return;
    const auto behavior = value<"arming_handler.disarm_behavior">();
    if (behavior && is(behavior, TimeoutBehavior::coast)) return;
    fault("at its communication timeout the module runs its disarm behaviour, which does not coast",
          "set propeller_motor_control.timeout_meaning to 0, or arming_handler.disarm_behavior to 0");
  }

  void other_inputs() {
    const auto allowed = value<"hobby_input.allowed_protocols">();
    if (!allowed || *allowed == kHobbyDisabled) return;
    fault(
        fmt::format("the hobby input is enabled (allowed_protocols {:g}): noise on it can command the motor", *allowed),
        "set hobby_input.allowed_protocols to 254 with the vendor's control program");
  }

  void motor() {
    const auto pairs = value<"brushless_drive.motor_pole_pairs">();
    const auto kv = value<"brushless_drive.motor_Kv">();
    const auto amps = value<"brushless_drive.motor_I_max">();
    if (pairs && *pairs != kPolePairs)
      warn(fmt::format("motor_pole_pairs is {:g}, a 2306 has {:g}: reported speeds would be wrong by their ratio",
                       *pairs, kPolePairs),
           "correct brushless_drive.motor_pole_pairs with the vendor's control program");
    if (kv && !(std::abs(*kv / kMotorKv - 1) <= 0.1))
      warn(fmt::format("motor_Kv is {:.4g} RPM/V, a 2306-2200Kv has {:g}: estimated currents and limits are off", *kv,
                       kMotorKv),
           "correct brushless_drive.motor_Kv with the vendor's control program");
    if (amps && !(*amps <= kMotorAmps))
      warn(fmt::format("motor_I_max is {:.4g} A; above {:g} A the motor overheats", *amps, kMotorAmps),
           "lower brushless_drive.motor_I_max");
    if (module_.coil_temperature_client() == 0)
      warn("no coil temperature from the module: nothing guards the coil", "update the firmware");
    if (module_.coil_temperature_client() == static_cast<int>(Client::temperature_estimator))
      note("old firmware: coil temperature from temperature_estimator");
    if (derates(value<"temperature_monitor_uc.derate">(), 1) ||
        derates(value<"coil_temperature_estimator.derate">(), 1) ||
        derates(value<"temperature_estimator.derate">(), kNoDerate) ||
        derates(value<"brushless_drive.derate">(), kNoDerate))
      warn("the module already derates, with the motor at rest", "let it cool down");
    const auto warm = value<"coil_temperature_estimator.otw">();
    const double limit = intention_.coil_temperature_max_degc;
    if (warm && limit > 0 && !(*warm >= limit))
      warn(
          fmt::format("the module derates above a coil temperature of {:.4g} °C, the limit is {:.4g} °C", *warm, limit),
          "lower the coil temperature limit to that value");
  }

  void controller() {
    const auto start = value<"brushless_drive.motor_redline_start">();
    const double fastest = intention_.speed_max_rad_s;
    if (start && fastest > 0 && !(*start > fastest))
      warn(fmt::format("the module derates above {:.4g} rad/s (redline), the fastest step needs {:.4g} rad/s", *start,
                       fastest),
           "lower the top speed, or raise brushless_drive.motor_redline_start");
    if (intention_.clock_unchecked)
      note("the module's clock is unchecked: its speeds may be off by some tenths of a percent",
           "measure it: `kphi devices --bench FILE --clock-gain`");
    const auto kp = value<"propeller_motor_control.velocity_Kp">();
    const auto ki = value<"propeller_motor_control.velocity_Ki">();
    if (kp && ki && !(*kp > 0) && !(*ki > 0))
      warn("velocity_Kp and velocity_Ki are 0: the speed is not controlled", "tune the controller");
    std::vector<const char*> unset;
    const auto demand = [&](const char* name, const std::optional<double>& term) {
      if (term && !(*term > 0)) unset.push_back(name);
    };
    demand("velocity_ff1", value<"propeller_motor_control.velocity_ff1">());
    demand("velocity_ff2", value<"propeller_motor_control.velocity_ff2">());
    if (!unset.empty())
      warn(fmt::format("{} is unset: steps settle late or never", fmt::join(unset, " and ")),
           "identify it for this propeller: V = ff1 w + ff2 w^2, ff2 is near 3e-7 for 5 inches");
    const auto hertz = value<"propeller_motor_control.input_filter_fc">();
    if (hertz && !(*hertz >= kSlowFilter))
      warn(fmt::format("input_filter_fc is {:g} Hz: a new speed reaches the controller only after {:.2g} s", *hertz,
                       1 / (2 * kPi * *hertz)),
           "raise propeller_motor_control.input_filter_fc to 10 Hz or more");
  }

  void slewing() {
    const auto slew = value<"brushless_drive.slew_volts_per_second">();
    if (bits(value<"brushless_drive.slew_enable">()) == 0 || !slew) return;
    std::string what = fmt::format("the drive voltage is limited to {:.4g} V/s: steps settle later", *slew);
    if (*slew >= kSlowSlew) return note(std::move(what));
    warn(std::move(what), "raise brushless_drive.slew_volts_per_second to 100 or more");
  }

  const AuditRecord& module_;
  const Intention& intention_;
  const double supply_volts_;
  std::vector<Finding> findings_;
};

}  // namespace

AuditRecord read_audit(const Ask& ask, bool newer_coil_client) {
  const Client absent = newer_coil_client ? Client::temperature_estimator : Client::coil_temperature_estimator;
  std::vector<Inquiry> asked;
  for (const Entry& entry : kEntries) {
    if (entry.audited && entry.type != absent) asked.push_back({&entry, std::nullopt});
  }
  const std::vector<Reply> replies = ask(asked);
  AuditRecord record;
  for (std::size_t i = 0; i < asked.size() && i < replies.size(); ++i) {
    if (replies[i].value) record.values[asked[i].entry] = *replies[i].value;
  }
  return record;
}

std::vector<Finding> audit(const AuditRecord& module, const Intention& intention) {
  return Checks(module, intention).all();
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
