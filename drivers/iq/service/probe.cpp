#include "drivers/iq/service/probe.hpp"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <set>
#include <thread>

#include "base/error.hpp"
#include "drivers/iq/link/motor.hpp"

namespace kphi::iq {
namespace {

using std::chrono::steady_clock;
constexpr const Entry& kAsked = entry<"brushless_drive.drive_mode">;
/// In the order in which they are tried: the factory's, the usual, then the rest.
constexpr unsigned kBauds[] = {115200, 921600, 1000000, 2000000, 460800, 230400, 57600, 38400, 19200, 9600};
constexpr Duration kWriteLimit = std::chrono::milliseconds(500);
constexpr Duration kAdapter = std::chrono::milliseconds(50);  ///< bytes that only an adapter knows of may still leave
constexpr Duration kReply = std::chrono::milliseconds(60);
constexpr int kLastId = static_cast<int>(ModuleId::last);
constexpr Duration kTurn = std::chrono::milliseconds(18);  ///< for each id; a USB adapter may be 16 ms late
constexpr Duration kSlowRoundTrip = std::chrono::milliseconds(4);
constexpr Duration kLastTurn = std::chrono::milliseconds(100);

Duration on_wire(std::size_t bytes, unsigned baud) { return from_seconds(10.0 * static_cast<double>(bytes) / baud); }

/// A serial line searched by hand, blocking. Wall time.
class Search {
 public:
  Search(const std::string& device, unsigned baud) : port_(device, baud) {}

  /// Of this host's port only. Waits until all has left; then both directions are emptied, and the module's parser too,
  /// which may wait for the end of a false frame. Coasts whatever listens, this id and all.
  void begin(unsigned baud, int module_id) {
    port_.drain(kWriteLimit);
    std::this_thread::sleep_for(kAdapter);
    port_.set_baud(baud);
    parser_.reset();
    write(std::array<std::uint8_t, kMaxFrame>{});
    for (int i = 0; i < 3; ++i) {
      for (const int id : {module_id, static_cast<int>(ModuleId::broadcast)})
        send(make(entry<"propeller_motor_control.ctrl_coast">, Access::set, id));
    }
  }
  /// Asks this id, and gives each id that answers within `wall` of the last byte sent to `heard`.
  void ask(int module_id, Duration wall, auto&& heard) {
    send(make(kAsked, Access::get, module_id));
    const auto end = steady_clock::now() + wall + on_wire(port_.unsent(), port_.baud());
    for (bool enough = false; !enough && port_.wait(end - steady_clock::now());) {
      std::array<std::uint8_t, 512> buffer;
      const std::size_t n = port_.read(buffer);
      parser_.push(std::span(buffer).first(n), [&](const Packet& packet, std::uint64_t) {
        const bool reply = packet.standard() && packet.access() == Access::reply &&
                           packet.type == static_cast<std::uint8_t>(kAsked.type) && packet.sub() == kAsked.sub;
        enough = (reply && heard(packet)) || enough;
      });
    }
  }

 private:
  void send(const Packet& packet) {
    std::array<std::uint8_t, kMaxFrame> frame;
    write(std::span(frame).first(encode(packet, frame)));
  }
  void write(std::span<const std::uint8_t> bytes) {
    for (const auto end = steady_clock::now() + kWriteLimit; !bytes.empty() && steady_clock::now() < end;) {
      bytes = bytes.subspan(port_.write(bytes));
      if (!bytes.empty()) port_.drain(std::chrono::milliseconds(2));
    }
  }

  serial::Port port_;
  Parser parser_;
};

/// Two queries, because the module may take the first for the end of a frame.
bool answers_at(Search& line, int module_id, unsigned baud) {
  line.begin(baud, module_id);
  bool answers = false;
  for (int i = 0; i < 2 && !answers; ++i) {
    line.ask(module_id, kReply + on_wire(kMaxFrame, baud), [&](const Packet& packet) {
      answers |= packet.module_id() == module_id && packet.data().size() == size_of(kAsked.format);
      return answers;
    });
  }
  return answers;
}

}  // namespace

std::optional<unsigned> find_baud(const std::string& device, int module_id, unsigned first) {
  Search line(device, first);
  if (answers_at(line, module_id, first)) return first;
  for (const unsigned baud : kBauds) {
    if (baud != first && answers_at(line, module_id, baud)) return baud;
  }
  return std::nullopt;
}

// One id at a time, because replies share a wire. A late reply still carries its id.
std::vector<int> find_ids(const std::string& device, unsigned baud) {
  Search line(device, baud);
  line.begin(baud, static_cast<int>(ModuleId::broadcast));
  std::set<int> ids;
  for (int id = 0; id <= kLastId; ++id) {
    line.ask(id, id < kLastId ? kTurn : kLastTurn, [&](const Packet& packet) {
      if (packet.module_id() <= kLastId) ids.insert(packet.module_id());
      return false;
    });
  }
  return {ids.begin(), ids.end()};
}

namespace {

void append(std::vector<Finding>& all, std::vector<Finding> more) {
  all.insert(all.end(), std::move_iterator(more.begin()), std::move_iterator(more.end()));
}

void judge_line(const Counters& counters, Probe& found) {
  if (found.round_trip > kSlowRoundTrip)
    found.findings.push_back(
        {Severity::warning,
         fmt::format("slow line: a query and its reply take {:.1f} ms", 1e3 * to_seconds(found.round_trip)),
         "shorten the adapter's latency timer, or raise the baud rate"});
  const std::uint64_t damaged = counters.crc_errors + counters.wrong_length;
  if (damaged > 0)
    found.findings.push_back(
        {Severity::warning, fmt::format("{} damaged frames received", damaged), "check cable, ground and baud rate"});
  if (!found.adapter) return;
  if (auto slow = serial::judge_latency_timer(*found.adapter)) found.findings.push_back(std::move(*slow));
}

void look_at(Motor& module, const Clock& clock, const ProbeSettings& settings, Probe& found) {
  // One question at a time: only a query that has the line to itself tells the round trip.
  const Ask ask = [&](const std::vector<Inquiry>& inquiries) {
    std::vector<Reply> replies;
    for (const Inquiry& inquiry : inquiries) {
      if (settings.give_up()) throw DeviceError("motor module on " + module.device(), "ask", "stopped by request");
      replies.push_back(module.inquire({inquiry}).at(0));
    }
    return replies;
  };
  found.adapter = serial::adapter_of(serial::path_of(module.device()));
  append(found.findings, set_timeout(ask));
  const bool newer = ask({{&entry<"coil_temperature_estimator.t_coil">, {}}})[0].value.has_value();
  found.record = read_audit(ask, newer);
  append(found.findings, audit(*found.record, settings.intention));
  found.round_trip = clock.shrunk(module.round_trips().quantile(0.5));
  judge_line(module.counters(), found);
  if (!settings.clock_gain) return;
  const auto pause = [&](Duration bench) { std::this_thread::sleep_for(clock.shrunk(bench)); };
  found.clock_gain = measure_clock_gain(ask, pause, *settings.clock_gain);
  found.clock_gain->uid = found.record->uid();
  append(found.findings, found.clock_gain->findings());
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
                             fmt::join(kBauds, ", "), line.baud),
                 "check its supply, RX and TX"};
}

/// "12.5 V", or "?" when unknown.
std::string value_text(const std::optional<double>& value, const char* unit) {
  return value ? fmt::format("{:.5g}{}{}", static_cast<float>(*value), *unit == 0 ? "" : " ", unit) : "?";
}

std::string coil_words(const AuditRecord& module) {
  const int client = module.coil_temperature_client();
  if (client == 83) return "coil " + value_text(module.value<"coil_temperature_estimator.t_coil">(), "°C");
  if (client == 77) return "coil " + value_text(module.value<"temperature_estimator.temp">(), "°C") + " (old client)";
  return "no coil temperature";
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
  return text;
}

std::string Probe::in_short() const {
  if (!record) return "";
  return fmt::format("firmware {}, uid {}, supply {}, {}, round trip {:.2f} ms",
                     record->firmware() ? record->firmware()->text() : "?", record->uid().empty() ? "?" : record->uid(),
                     value_text(record->value<"power_monitor.volts">(), "V"), coil_words(*record),
                     1e3 * to_seconds(round_trip));
}

std::vector<std::string> Probe::gain_lines() const {
  if (!clock_gain) return {};
  return {
      fmt::format("its clock runs {:+.1f} ppm against this computer's, u {:.1f} ppm, from {} readings over {:.0f} s; "
                  "write under iq: in the bench file:",
                  clock_gain->ppm(), 1e6 * clock_gain->u_factor, clock_gain->readings, clock_gain->duration_s),
      clock_gain->yaml()};
}

std::vector<Finding> set_timeout(const Ask& ask) {
  const std::vector<Inquiry> settings = {
      {&entry<"propeller_motor_control.timeout">, Settings().module_timeout_s},
      {&entry<"propeller_motor_control.timeout_behavior">, static_cast<double>(TimeoutBehavior::coast)},
      {&entry<"propeller_motor_control.timeout_song_option">, static_cast<double>(SongOption::never)}};
  const std::vector<Reply> replies = ask(settings);
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const auto& [set, value] = settings[i];
    const bool may_lack_it = i > 0;
    if (replies[i].accepted || (!replies[i].value && may_lack_it)) continue;
    findings.push_back(
        {Severity::fault,
         fmt::format("{} was set to {:.9g} {} and {}", set->path, *value, set->unit,
                     replies[i].value ? fmt::format("reads back {:.9g}", *replies[i].value) : "does not answer"),
         "check the firmware version and the line to the module, then connect again"});
  }
  return findings;
}

Probe probe(const SerialLine& line, const Clock& clock, const ProbeSettings& settings) {
  Probe found;
  std::optional<Motor> module;
  try {
    Settings inspecting;
    inspecting.module_id = line.module_id;
    inspecting.inspects = true;
    module.emplace(line.device, line.baud, inspecting, clock, std::string(), settings.give_up);
    look_at(*module, clock, settings, found);
  } catch (const DeviceError& error) {
    found.findings.push_back({Severity::fault, error.what(), ""});
    if (!module && settings.search) {
      if (auto elsewhere = search_for(line)) found.findings.push_back(std::move(*elsewhere));
    }
  }
  if (module) found.counters = module->counters();
  put_worst_first(found.findings);
  return found;
}

}  // namespace kphi::iq
