#include "drivers/iq/probe.hpp"

#include <fmt/format.h>

#include <iterator>

#include "drivers/device_error.hpp"
#include "drivers/iq/setting.hpp"

namespace kphi::iq {
namespace {

void append(std::vector<Finding>& all, std::vector<Finding> more) {
  all.insert(all.end(), std::move_iterator(more.begin()), std::move_iterator(more.end()));
}

void look_at(SerialDialogue& module, const ProbeSettings& settings, Probe& found) {
  found.device = module.device();
  found.adapter = serial::adapter_of(module.device());
  append(found.findings, set_and_read_back(module, connection_settings(settings.module_timeout_s)));
  found.record = read_audit(module);
  append(found.findings, audit(*found.record, settings.intention));
  append(found.findings, module.findings());
  if (found.adapter) {
    if (auto slow = serial::judge_latency_timer(*found.adapter)) found.findings.push_back(std::move(*slow));
  }
  found.round_trip = module.median_round_trip();
}

/// "12.5 V", or "?" when it was not told.
std::string told(const std::optional<double>& value, const char* unit) {
  return value ? fmt::format("{:.5g}{}{}", static_cast<float>(*value), *unit == 0 ? "" : " ", unit) : "?";
}

std::string coil_words(const AuditRecord& module) {
  switch (module.coil_temperature_client()) {
    case 83:
      return "coil " + told(module.value<"coil_temperature_estimator.t_coil">(), "°C");
    case 77:
      return "coil " + told(module.value<"temperature_estimator.temp">(), "°C") + " (old client)";
    default:
      return "no coil temperature";
  }
}

void describe(const AuditRecord& module, std::vector<std::string>& text) {
  text.push_back(fmt::format(
      "firmware {}, hardware {}, electronics {}, uid {}", module.firmware() ? module.firmware()->text() : "?",
      module.hardware() ? module.hardware()->text() : "?", module.electronics() ? module.electronics()->text() : "?",
      module.uid().empty() ? "?" : module.uid()));
  text.push_back(fmt::format("{} pole pairs, {}, {}, at most {}, redline {} to {}",
                             told(module.value<"brushless_drive.motor_pole_pairs">(), ""),
                             told(module.value<"brushless_drive.motor_Kv">(), "RPM/V"),
                             told(module.value<"brushless_drive.motor_R_ohm">(), "ohm"),
                             told(module.value<"brushless_drive.motor_I_max">(), "A"),
                             told(module.value<"brushless_drive.motor_redline_start">(), ""),
                             told(module.value<"brushless_drive.motor_redline_end">(), "rad/s")));
  text.push_back(fmt::format("supply {}, regeneration held back from {} to {}, timeout {}, {}",
                             told(module.value<"power_monitor.volts">(), "V"),
                             told(module.value<"brushless_drive.v_max_start">(), ""),
                             told(module.value<"brushless_drive.volts_limit">(), "V"),
                             told(module.value<"propeller_motor_control.timeout">(), "s"), coil_words(module)));
}

}  // namespace

std::vector<std::string> Probe::lines() const {
  std::vector<std::string> text;
  if (record) describe(*record, text);
  if (adapter) {
    text.push_back(adapter->line() +
                   (adapter->latency_timer_ms ? fmt::format(", latency timer {} ms", *adapter->latency_timer_ms) : ""));
  }
  if (counters.replies > 0) {
    text.push_back(fmt::format("round trip {:.2f} ms; {} questions, {} answers, {} damaged frames",
                               1e3 * to_seconds(round_trip), counters.requests, counters.replies,
                               counters.crc_errors + counters.wrong_length));
  }
  if (clock_gain) {
    text.push_back(
        fmt::format("its clock is {:+.1f} ppm against this host's, u {:.1f} ppm, by {} readings over {:.0f} s; "
                    "for the bench file, under iq:",
                    clock_gain->ppm(), 1e6 * clock_gain->u_factor, clock_gain->readings, clock_gain->duration_s));
    text.push_back(clock_gain->yaml());
  }
  for (const Finding& finding : findings) text.push_back(finding.line());
  return text;
}

Probe probe(const DialoguePlace& place, const Clock& clock, const ProbeSettings& settings) {
  Probe found;
  try {
    SerialDialogue module(place, clock);
    try {
      look_at(module, settings, found);
      if (settings.clock_gain) {
        found.clock_gain = measure_clock_gain(module, *settings.clock_gain);
        found.clock_gain->uid = found.record->uid();
        append(found.findings, found.clock_gain->findings());
      }
    } catch (const DeviceError& error) {
      found.findings.push_back({Severity::fault, error.what(), ""});
    }
    found.counters = module.counters();
  } catch (const DeviceError& error) {
    found.findings.push_back({Severity::fault, error.what(), ""});
  }
  put_worst_first(found.findings);
  return found;
}

}  // namespace kphi::iq
