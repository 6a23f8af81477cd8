#include "drivers/iq/service/probe.hpp"

#include <fmt/format.h>

#include <array>
#include <iterator>

#include "base/error.hpp"
#include "drivers/iq/service/dialogue.hpp"

namespace kphi::iq {
namespace {

constexpr const Entry& kDriveMode = entry<"brushless_drive.drive_mode">;
constexpr Duration kReply = std::chrono::milliseconds(60);
constexpr int kIds = static_cast<int>(ModuleId::last) + 1;
constexpr Duration kTurn = std::chrono::milliseconds(18);  ///< for each id; a USB adapter may be 16 ms late
constexpr Duration kLastTurn = std::chrono::milliseconds(100);

/// Two queries, because the module may take the first for the end of a frame.
bool answers_at(Conversation& line, int module_id, unsigned baud) {
  line.set_baud(baud);
  line.coast(module_id);
  return line.ask(kDriveMode, module_id, kReply) || line.ask(kDriveMode, module_id, kReply);
}

}  // namespace

const std::vector<unsigned>& bauds_to_try() {
  static const std::vector<unsigned> bauds{115200, 921600, 1000000, 2000000, 460800, 230400, 57600, 38400, 19200, 9600};
  return bauds;
}

std::optional<unsigned> find_baud(const std::string& device, int module_id, unsigned first) {
  Conversation line(device, first);
  if (answers_at(line, module_id, first)) return first;
  for (const unsigned baud : bauds_to_try()) {
    if (baud != first && answers_at(line, module_id, baud)) return baud;
  }
  return std::nullopt;
}

// One id at a time, because replies share a wire. A late reply still carries its id.
std::vector<int> find_ids(const std::string& device, unsigned baud) {
  Conversation line(device, baud);
  line.set_baud(baud);
  line.coast(static_cast<int>(ModuleId::broadcast));
  std::array<bool, kIds> answered{};
  const auto note = [&](const Packet& packet) {
    const int id = packet.module_id();
    if (id < kIds && is_reply_of(packet, kDriveMode, id)) answered[static_cast<std::size_t>(id)] = true;
    return false;
  };
  for (int id = 0; id < kIds; ++id) {
    line.tell(get<"brushless_drive.drive_mode">(id));
    line.listen(id + 1 < kIds ? kTurn : kLastTurn, note);
  }
  std::vector<int> ids;
  for (int id = 0; id < kIds; ++id) {
    if (answered[static_cast<std::size_t>(id)]) ids.push_back(id);
  }
  return ids;
}

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

/// Where a module is that does not answer at its place. nullopt: it does answer, or the port cannot be used; another
/// finding says why.
std::optional<Finding> search_for(const SerialLine& line) {
  try {
    const auto baud = find_baud(line.device, line.module_id, line.baud);
    if (baud == line.baud) return std::nullopt;
    if (baud) {
      return Finding{Severity::fault,
                     fmt::format("module {} answers at {} baud, not at {}", line.module_id, *baud, line.baud),
                     fmt::format("write baud: {} under iq: in the bench file", *baud)};
    }
    const std::vector<int> ids = find_ids(line.device, line.baud);
    if (!ids.empty()) {
      return Finding{
          Severity::fault,
          fmt::format("id {} answers at {} baud, not id {}", fmt::join(ids, ", "), line.baud, line.module_id),
          fmt::format("write module_id: {} under iq: in the bench file", ids.front())};
    }
  } catch (const DeviceError&) {
    return std::nullopt;
  }
  return Finding{Severity::note,
                 fmt::format("searched for it at {} baud, and for any id at {} baud: no answer",
                             fmt::join(bauds_to_try(), ", "), line.baud),
                 "check its supply, RX and TX"};
}

/// "12.5 V", or "?" when unknown.
std::string value_text(const std::optional<double>& value, const char* unit) {
  return value ? fmt::format("{:.5g}{}{}", static_cast<float>(*value), *unit == 0 ? "" : " ", unit) : "?";
}

std::string coil_words(const AuditRecord& module) {
  switch (module.coil_temperature_client()) {
    case 83:
      return "coil " + value_text(module.value<"coil_temperature_estimator.t_coil">(), "°C");
    case 77:
      return "coil " + value_text(module.value<"temperature_estimator.temp">(), "°C") + " (old client)";
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
                             value_text(module.value<"brushless_drive.motor_pole_pairs">(), ""),
                             value_text(module.value<"brushless_drive.motor_Kv">(), "RPM/V"),
                             value_text(module.value<"brushless_drive.motor_R_ohm">(), "ohm"),
                             value_text(module.value<"brushless_drive.motor_I_max">(), "A"),
                             value_text(module.value<"brushless_drive.motor_redline_start">(), ""),
                             value_text(module.value<"brushless_drive.motor_redline_end">(), "rad/s")));
  text.push_back(fmt::format("supply {}, regeneration limited from {} to {}, timeout {}, {}",
                             value_text(module.value<"power_monitor.volts">(), "V"),
                             value_text(module.value<"brushless_drive.v_max_start">(), ""),
                             value_text(module.value<"brushless_drive.volts_limit">(), "V"),
                             value_text(module.value<"propeller_motor_control.timeout">(), "s"), coil_words(module)));
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
    text.push_back(fmt::format("round trip {:.2f} ms; {} queries, {} replies, {} damaged frames",
                               1e3 * to_seconds(round_trip), counters.requests, counters.replies,
                               counters.crc_errors + counters.wrong_length));
  }
  if (clock_gain) {
    text.push_back(
        fmt::format("its clock runs {:+.1f} ppm against this host's, u {:.1f} ppm, from {} readings over {:.0f} s; "
                    "write under iq: in the bench file:",
                    clock_gain->ppm(), 1e6 * clock_gain->u_factor, clock_gain->readings, clock_gain->duration_s));
    text.push_back(clock_gain->yaml());
  }
  for (const Finding& finding : findings) text.push_back(finding.line());
  return text;
}

Probe probe(const SerialLine& line, const Clock& clock, const ProbeSettings& settings) {
  Probe found;
  try {
    SerialDialogue module(line, clock);
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
    if (settings.search) {
      if (auto elsewhere = search_for(line)) found.findings.push_back(std::move(*elsewhere));
    }
  }
  put_worst_first(found.findings);
  return found;
}

}  // namespace kphi::iq
