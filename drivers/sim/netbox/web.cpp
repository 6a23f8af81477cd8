// The box's web side. Read: netftapi2.xml and netftcalapi.xml in the form that a real box was seen to send. Written:
// setting.cgi, comm.cgi, config.cgi, moncon.cgi (manual, CGI interface). Each page takes its own variables only; values
// are clamped silently, invalid ones ignored silently, and the answer is 302.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include "base/number.hpp"
#include "drivers/sim/netbox/fault_injector.hpp"
#include "drivers/sim/physics/motor.hpp"

namespace kphi::sim {
namespace {

constexpr std::size_t kFloatCharacters = 20;
constexpr std::size_t kNameCharacters = 32, kUserCharacters = 16;
constexpr int kWritesServed = 3;

// --- read

std::string response(std::string_view status, std::string_view type, std::string_view body) {
  return fmt::format(
      "HTTP/1.0 {}\r\nServer: Net F/T\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}", status,
      type, body.size(), body);
}

std::string xml_response(std::string_view body, std::string_view type = "text/xml") {
  return response("200 OK", type, body);
}

std::string refusal(std::string_view status) {
  return response(status, "text/html", fmt::format("<html><body>{}</body></html>", status));
}

std::string not_found() { return refusal("404 Not Found"); }

/// One word per monitor condition.
template <class Word>
std::string conditions(const NetBoxSettings& settings, Word word) {
  std::string out;
  for (const MonitorCondition& condition : settings.conditions) {
    if (!out.empty()) out += settings.quirks.array_separator;
    out += word(condition);
  }
  return out;
}

std::string torque_text(const NetBoxSettings& settings, int code) {
  const std::string plain(unit(kTorqueUnits, code).name);
  if (!settings.quirks.torque_text_with_hyphen) return plain;
  if (plain == "Nm") return "N-m";
  if (plain == "Nmm") return "N-mm";
  if (plain == "kNm") return "kN-m";
  return plain;
}

/// In the slot's units.
Wrench ranges(const NetBoxSettings& settings, const Slot& slot) {
  Wrench range{};
  for (std::size_t axis = 0; axis < 6 && slot.calibration == 0; ++axis) {
    range[axis] = settings.range[axis] /
                  (axis < 3 ? unit(kForceUnits, slot.force_unit).si : unit(kTorqueUnits, slot.torque_unit).si);
  }
  return range;
}

/// The box's ENABL.
const char* enabled(const NetBoxSettings& settings, bool yes) {
  if (settings.quirks.flags_as_digits) return yes ? "1" : "0";
  return yes ? "Enabled" : "Disabled";
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (static_cast<unsigned char>(c) < 0x20)
      out += '?';
    else
      out += c;
  }
  return out;
}

std::string configuration_page(const NetBoxDevice& box, int number) {
  const NetBoxSettings& settings = box.settings();
  const Slot& slot = settings.slots[static_cast<std::size_t>(number)];
  const bool calibrated = slot.calibration == 0;
  std::string page = "<?xml version=\"1.0\"?><netft>\n";
  const std::string separator(1, settings.quirks.array_separator);
  const auto joined = [&](const auto& values) { return fmt::format("{}", fmt::join(values, separator)); };
  const auto add = [&](std::string_view tag, const auto& value) {
    fmt::format_to(std::back_inserter(page), "<{}>{}</{}>\n", tag, value, tag);
  };
  add("runstat", fmt::format("0x{:08x}", box.status()));
  add("runrate", kTicksPerSecond);
  add("runpkmx", joined(box.peaks_high()));
  add("runpkmn", joined(box.peaks_low()));
  add("runmcb", fmt::format("0x{:08x}", box.signal().breached()));
  add("runmco", fmt::format("0x{:02x}", box.signal().output_code()));
  add("runmcl", box.signal().latched() ? 1 : 0);
  add("cfgnam", escaped(slot.name));
  add("cfgcalsel", slot.calibration);
  add("cfgcalsn", calibrated ? settings.serial : "FT0000");
  add("scfgfu", unit(kForceUnits, slot.force_unit).name);
  add("scfgtu", torque_text(settings, slot.torque_unit));
  add("cfgtfx", joined(slot.tool_transform));
  add("scfgtdu", unit(kDistanceUnits, slot.distance_unit).name);
  add("scfgtau", unit(kAngleUnits, slot.angle_unit).name);
  add("cfgcpf", counts_per_force(settings, number));
  add("cfgcpt", counts_per_torque(settings, number));
  add("cfgmr", joined(ranges(settings, slot)));
  add("cfgusra", escaped(slot.user_a));
  add("cfgusrb", escaped(slot.user_b));
  add("setcfgsel", settings.active_slot);
  add("setpke", settings.peaks ? 1 : 0);
  add("setmce", settings.monitoring ? 1 : 0);
  add("setbias", joined(settings.bias_vector));
  add("mce", conditions(settings, [](const auto& c) { return c.enabled ? "1" : "0"; }));
  add("mcx", conditions(settings, [](const auto& c) { return std::to_string(c.axis); }));
  add("mcc", conditions(settings, [](const auto& c) { return std::to_string(c.comparison); }));
  add("mcv", conditions(settings, [](const auto& c) { return std::to_string(c.counts); }));
  add("mco", conditions(settings, [](const auto& c) { return fmt::format("0x{:02x}", c.output); }));
  add("setuserfilter", settings.filter);
  add("nethwaddr", "00:16:BD:00:00:01");
  add("netip", settings.address);
  add("comnetip", settings.address);
  add("comnetdhcp", "Disabled");
  add("comrdte", enabled(settings, settings.rdt_enabled));
  add("comrdtrate", kTicksPerSecond / box.divisor());
  add("comrdtbsiz", settings.records_per_datagram);
  add("mfgdigsn", "LOT0001");
  add("mfgdigver", "2.2.59");
  add("prodname", settings.quirks.axia ? "Ethernet Axia" : "Net F/T");
  add("cfgfu", slot.force_unit);
  add("cfgtu", slot.torque_unit);
  add("cfgtdu", slot.distance_unit);
  add("cfgtau", slot.angle_unit);
  add("comeipe", enabled(settings, settings.ethernet_ip));
  return page + "</netft>\n";
}

std::string calibration_page(const NetBoxDevice& box, int calibration) {
  const NetBoxSettings& settings = box.settings();
  const bool calibrated = calibration == 0;
  return fmt::format(
      "<?xml version=\"1.0\"?><netftCalibration>\n<calsn>{}</calsn>\n<calcpf>{}</calcpf>\n<calcpt>{}</calcpt>\n"
      "</netftCalibration>\n",
      calibrated ? settings.serial : "FT0000", calibrated ? settings.counts_per_force : 0,
      calibrated ? settings.counts_per_torque : 0);
}

/// "setbias3" with "setbias" -> 3; only below `count`.
std::optional<std::size_t> index_of(std::string_view name, std::string_view stem, std::size_t count) {
  if (!name.starts_with(stem)) return std::nullopt;
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(name.data() + stem.size(), name.data() + name.size(), index);
  if (error != std::errc{} || end != name.data() + name.size() || index >= count) return std::nullopt;
  return index;
}

/// "index=3" -> 3, "" -> the active one.
std::optional<int> slot_of(std::string_view query, int active) {
  if (query.empty()) return active;
  const auto index = index_of(query, "index=", kSlots);
  return index ? std::optional(static_cast<int>(*index)) : std::nullopt;
}

// --- written

struct Variable {
  std::string_view name;
  std::string value;
};

int hex_digit(char c) noexcept {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// "%26" -> "&", "+" -> " ".
std::string decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape =
        text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 && hex_digit(text[i + 2]) >= 0;
    if (escape) {
      out += static_cast<char>(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2]));
      i += 2;
    } else {
      out += text[i] == '+' ? ' ' : text[i];
    }
  }
  return out;
}

std::vector<Variable> variables_of(std::string_view query) {
  std::vector<Variable> variables;
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), pair.size() + 1));
    const std::size_t equals = pair.find('=');
    if (equals != std::string_view::npos)
      variables.push_back({pair.substr(0, equals), decoded(pair.substr(equals + 1))});
  }
  return variables;
}

std::optional<double> number(const std::string& text) {
  const auto value = parse_double(text);
  return value && std::isfinite(*value) && text.size() <= kFloatCharacters ? value : std::nullopt;
}

template <class T>
void set(T& to, const std::string& text, double low, double high) {
  std::string_view digits = text;
  if (digits.substr(0, 2) == "0x") {
    int value = 0;
    const auto [end, error] = std::from_chars(digits.data() + 2, digits.data() + digits.size(), value, 16);
    if (error == std::errc{} && end == digits.data() + digits.size())
      to = static_cast<T>(std::clamp<double>(value, low, high));
    return;
  }
  if (const auto value = number(text)) to = static_cast<T>(std::clamp(*value, low, high));
}

void write_setting(NetBoxSettings& settings, const Variable& v) {
  if (v.name == "setcfgsel") set(settings.active_slot, v.value, 0, kSlots - 1);
  if (v.name == "setuserfilter") set(settings.filter, v.value, 0, 12);
  if (v.name == "setpke") set(settings.peaks, v.value, 0, 1);
  if (const auto i = index_of(v.name, "setbias", 6)) set(settings.bias_vector[*i], v.value, -32768, 32767);
}

/// The network's own keys take effect at power-up only, and this box keeps its address.
void write_communication(NetBoxSettings& settings, const Variable& v) {
  if (v.name == "comrdte") set(settings.rdt_enabled, v.value, 0, 1);
  if (v.name == "comrdtrate") set(settings.rate_hz, v.value, 1, kTicksPerSecond);
  if (v.name == "comrdtbsiz") set(settings.records_per_datagram, v.value, 1, kRecordsPerDatagramMax);
  if (v.name == "comeipe") set(settings.ethernet_ip, v.value, 0, 1);
}

void write_slot(Slot& slot, const Variable& v) {
  if (v.name == "cfgnam") slot.name = v.value.substr(0, kNameCharacters);
  if (v.name == "cfgcalsel") set(slot.calibration, v.value, 0, kSlots - 1);
  if (v.name == "cfgfu") set(slot.force_unit, v.value, 1, static_cast<double>(kForceUnits.size()));
  if (v.name == "cfgtu") set(slot.torque_unit, v.value, 1, static_cast<double>(kTorqueUnits.size()));
  if (v.name == "cfgtdu") set(slot.distance_unit, v.value, 1, static_cast<double>(kDistanceUnits.size()));
  if (v.name == "cfgtau") set(slot.angle_unit, v.value, 1, static_cast<double>(kAngleUnits.size()));
  if (v.name == "cfgusra") slot.user_a = v.value.substr(0, kUserCharacters);
  if (v.name == "cfgusrb") slot.user_b = v.value.substr(0, kUserCharacters);
  if (const auto i = index_of(v.name, "cfgtfx", 6)) set(slot.tool_transform[*i], v.value, -1e6, 1e6);
}

void write_condition(NetBoxSettings& settings, const Variable& v) {
  auto& conditions = settings.conditions;
  if (v.name == "setmce") set(settings.monitoring, v.value, 0, 1);
  if (const auto i = index_of(v.name, "mce", kSlots)) set(conditions[*i].enabled, v.value, 0, 1);
  if (const auto i = index_of(v.name, "mcx", kSlots)) set(conditions[*i].axis, v.value, -1, 5);
  if (const auto i = index_of(v.name, "mcv", kSlots)) set(conditions[*i].counts, v.value, INT32_MIN, INT32_MAX);
  if (const auto i = index_of(v.name, "mco", kSlots)) set(conditions[*i].output, v.value, 0, 255);
  if (const auto i = index_of(v.name, "mcc", kSlots)) {
    int sign = conditions[*i].comparison;
    set(sign, v.value, -1, 1);
    if (sign != 0) conditions[*i].comparison = sign;
  }
}

std::string found(std::string_view page) {
  return "HTTP/1.0 302 Found\r\nServer: Net F/T\r\nLocation: /" + std::string(page.substr(0, page.find('.'))) +
         ".htm\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
}

// --- spoilt

std::string body_of(const std::string& answer) {
  constexpr std::string_view kEndOfHeaders = "\r\n\r\n";
  const std::size_t headers = answer.find(kEndOfHeaders);
  return headers == std::string::npos ? std::string() : answer.substr(headers + kEndOfHeaders.size());
}

/// The page with the line of element `tag`, if it has one, replaced by `edit(line)`.
template <class Edit>
std::string with_element(const std::string& answer, const std::string& tag, Edit edit,
                         std::string_view type = "text/xml") {
  std::string body = body_of(answer);
  const std::size_t begin = body.find("<" + tag + ">");
  if (begin != std::string::npos) {
    const std::size_t size = body.find('\n', begin) + 1 - begin;
    body.replace(begin, size, edit(body.substr(begin, size)));
  }
  return xml_response(body, type);
}

/// "Prüfstand" in Latin-1, in a page that says UTF-8.
std::string in_latin_1(const std::string& answer) {
  constexpr const char* kName =
      "<cfgnam>Pr\xfc"
      "fstand</cfgnam>\n";
  return with_element(
      answer, "cfgnam", [](const std::string&) { return kName; }, "text/xml; charset=utf-8");
}

std::string in_utf_16(const std::string& answer) {
  std::string body = "\xff\xfe";
  for (const char c : body_of(answer)) (body += c) += '\0';
  return xml_response(body, "text/xml; charset=utf-16");
}

}  // namespace

std::string NetBoxDevice::http(std::string_view request) {
  constexpr std::string_view kGet = "GET /";
  if (!request.starts_with(kGet)) return not_found();
  request.remove_prefix(kGet.size());
  const std::string_view target = request.substr(0, request.find_first_of(" \r\n"));
  const std::string_view page = target.substr(0, target.find('?'));
  const std::string_view query = target.substr(std::min(target.size(), page.size() + 1));
  for (const char* writable : {"setting.cgi", "comm.cgi", "config.cgi", "moncon.cgi"}) {
    if (page == writable) return write(page, query);
  }
  const auto slot = slot_of(query, settings_.active_slot);
  if (!slot) return not_found();
  if (page == "netftapi2.xml") return xml_response(configuration_page(*this, *slot));
  if (page != "netftcalapi.xml") return not_found();
  const bool named = !query.empty();
  return xml_response(
      calibration_page(*this, named ? *slot : settings_.slots[static_cast<std::size_t>(*slot)].calibration));
}

void NetBoxDevice::count_write() {
  if (writes_ == 0 || ticks_ - writes_since_ >= static_cast<std::uint64_t>(kTicksPerSecond)) {
    writes_since_ = ticks_;
    writes_ = 0;
  }
  ++writes_;
}

std::string NetBoxDevice::write(std::string_view page, std::string_view query) {
  count_write();
  if (settings_.quirks.only_three_writes && writes_ > kWritesServed) return found(page);
  const auto variables = variables_of(query);
  NetBoxSettings wanted = settings_;
  int slot = -1;
  for (const Variable& v : variables) {
    if (v.name == "cfgid") set(slot, v.value, -1, kSlots - 1);
  }
  for (const Variable& v : variables) {
    if (page == "setting.cgi") write_setting(wanted, v);
    if (page == "comm.cgi") write_communication(wanted, v);
    if (page == "moncon.cgi") write_condition(wanted, v);
    if (page == "config.cgi" && slot >= 0) write_slot(wanted.slots[static_cast<std::size_t>(slot)], v);
  }
  configure(wanted);
  return found(page);
}

void spoil_page(const Fault& fault, StreamReply& reply) {
  switch (fault.kind) {
    case FaultKind::http_slow:
      reply.wait = std::max(reply.wait, fault.delay);
      return;
    case FaultKind::http_truncated:
      reply.bytes.resize(std::min(reply.bytes.size(), static_cast<std::size_t>(fault.size)));
      return;
    case FaultKind::http_status:
      reply.bytes = refusal(fmt::format("{} {}", fault.code, fault.code < 500 ? "Not Found" : "Internal Server Error"));
      return;
    case FaultKind::http_oversized:
      reply.bytes = xml_response("<?xml version=\"1.0\"?><netft>" + std::string(fault.size, ' '));
      return;
    case FaultKind::http_charset:
      reply.bytes = fault.utf16 ? in_utf_16(reply.bytes) : in_latin_1(reply.bytes);
      return;
    case FaultKind::http_missing_tag:
      reply.bytes = with_element(reply.bytes, fault.tag, [](const std::string&) { return ""; });
      return;
    case FaultKind::http_duplicate_tag:
      reply.bytes = with_element(reply.bytes, fault.tag, [](const std::string& line) { return line + line; });
      return;
    default:
      return;
  }
}

}  // namespace kphi::sim
