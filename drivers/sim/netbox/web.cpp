// The box's web side. Read: netftapi2.xml and netftcalapi.xml in the form that a real box was seen to send. Written:
// setting.cgi and comm.cgi (manual, CGI interface). Each page takes its own variables only; values are clamped
// silently, others and invalid ones ignored silently, and the answer is 302.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <vector>

#include "base/number.hpp"
#include "drivers/sim/netbox/fault_injector.hpp"
#include "drivers/sim/physics/motor.hpp"

namespace kphi::sim {
namespace {

constexpr std::size_t kFloatCharacters = 20;
constexpr int kServedInASecond = 3;
constexpr const char* kSerial = "FT21001";  // of calibration 0
constexpr const char* kNoSerial = "FT0000";

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

/// "Nm" or "N-m".
std::string torque_text(const NetBoxSettings& settings, int code) {
  std::string text(unit(kTorqueUnits, code).name);
  const std::size_t newton = text.find('N');
  if (settings.quirks.torque_text_with_hyphen && newton != std::string::npos) text.insert(newton + 1, "-");
  return text;
}

std::string configuration_page(const NetBoxDevice& box, int number) {
  const NetBoxSettings& settings = box.settings();
  const Slot& slot = settings.slots[static_cast<std::size_t>(number)];
  const bool calibrated = number == 0;
  const Unit &force = unit(kForceUnits, slot.force_unit), &torque = unit(kTorqueUnits, slot.torque_unit);
  Wrench range{};
  for (std::size_t axis = 0; axis < 6 && calibrated; ++axis)
    range[axis] = settings.range[axis] / (axis < 3 ? force : torque).si;
  std::string page = "<?xml version=\"1.0\"?><netft>\n";
  const std::string separator(1, settings.quirks.array_separator);
  const auto joined = [&](const auto& values) { return fmt::format("{}", fmt::join(values, separator)); };
  const auto sixteen = [&](const char* word) { return joined(std::vector(kSlots, word)); };
  const auto flag = [&](bool on) {
    return settings.quirks.flags_as_digits ? on ? "1" : "0" : on ? "Enabled" : "Disabled";
  };
  const auto add = [&](std::string_view tag, const auto& value) {
    fmt::format_to(std::back_inserter(page), "<{}>{}</{}>\n", tag, value, tag);
  };
  add("runstat", fmt::format("0x{:08x}", box.status()));
  add("runrate", kTicksPerSecond);
  add("runpkmx", joined(box.peaks_high()));
  add("runpkmn", joined(box.peaks_low()));
  add("runmcb", "0x00000000");
  add("runmco", "0x00");
  add("runmcl", 0);
  add("cfgnam", calibrated ? "thrust stand" : "empty");
  add("cfgcalsel", number);
  add("cfgcalsn", calibrated ? kSerial : kNoSerial);
  add("scfgfu", force.name);
  add("scfgtu", torque_text(settings, slot.torque_unit));
  add("cfgtfx", joined(Wrench{}));
  add("scfgtdu", "mm");
  add("scfgtau", "degrees");
  add("cfgcpf", counts_per_force(settings, number));
  add("cfgcpt", counts_per_torque(settings, number));
  add("cfgmr", joined(range));
  add("cfgusra", "empty");
  add("cfgusrb", "empty");
  add("setcfgsel", settings.active_slot);
  add("setpke", 1);
  add("setmce", 0);
  add("setbias", joined(settings.bias_vector));
  add("mce", sixteen("0"));
  add("mcx", sixteen("-1"));
  add("mcc", sixteen("1"));
  add("mcv", sixteen("0"));
  add("mco", sixteen("0x00"));
  add("setuserfilter", settings.filter);
  add("nethwaddr", "00:16:BD:00:00:01");
  add("netip", settings.address);
  add("comnetip", settings.address);
  add("comnetdhcp", "Disabled");
  add("comrdte", flag(true));
  add("comrdtrate", kTicksPerSecond / box.divisor());
  add("comrdtbsiz", settings.records_per_datagram);
  add("mfgdigsn", "LOT0001");
  add("mfgdigver", "2.2.59");
  add("prodname", settings.quirks.axia ? "Ethernet Axia" : "Net F/T");
  add("cfgfu", slot.force_unit);
  add("cfgtu", slot.torque_unit);
  add("cfgtdu", 3);
  add("cfgtau", 1);
  add("comeipe", flag(false));
  return page + "</netft>\n";
}

/// Always per N and N m, whatever the slots' units.
std::string calibration_page(int calibration) {
  const bool calibrated = calibration == 0;
  return fmt::format(
      "<?xml version=\"1.0\"?><netftCalibration>\n<calsn>{}</calsn>\n<calcpf>{}</calcpf>\n<calcpt>{}</calcpt>\n"
      "</netftCalibration>\n",
      calibrated ? kSerial : kNoSerial, calibrated ? 1'000'000 : 0, calibrated ? 1'000'000 : 0);
}

/// "index=3" -> 3, "" -> the active one.
std::optional<int> slot_of(std::string_view query, int active) {
  constexpr std::string_view kIndex = "index=";
  if (query.empty()) return active;
  const auto index = query.starts_with(kIndex) ? parse_integer<int>(query.substr(kIndex.size())) : std::nullopt;
  return index && *index >= 0 && *index < kSlots ? index : std::nullopt;
}

// --- written

void write_variable(NetBoxSettings& settings, std::string_view page, std::string_view name, double value) {
  const auto within = [value](int low, int high) { return static_cast<int>(std::clamp<double>(value, low, high)); };
  const bool setting = page == "setting.cgi", communication = page == "comm.cgi";
  if (setting && name == "setcfgsel") settings.active_slot = within(0, kSlots - 1);
  if (setting && name == "setuserfilter") settings.filter = within(0, static_cast<int>(kFilterCutoffsHz.size()) - 1);
  if (communication && name == "comrdtrate") settings.rate_hz = within(1, kTicksPerSecond);
  if (communication && name == "comrdtbsiz") settings.records_per_datagram = within(1, kRecordsPerDatagramMax);
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
std::string with_element(const std::string& answer, const std::string& tag, auto edit,
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

int NetBoxDevice::PerSecond::count(std::uint64_t tick) noexcept {
  if (n == 0 || tick - since >= static_cast<std::uint64_t>(kTicksPerSecond)) *this = {tick, 0};
  return ++n;
}

std::string NetBoxDevice::http(std::string_view request) {
  constexpr std::string_view kGet = "GET /";
  using Served = NetBoxQuirks::Served;
  if (requests_.count(ticks_) > kServedInASecond && settings_.quirks.served != Served::all)
    return settings_.quirks.served == Served::three_then_closed ? "" : refusal("503 Service Unavailable");
  if (!request.starts_with(kGet)) return not_found();
  request.remove_prefix(kGet.size());
  const std::string_view target = request.substr(0, request.find_first_of(" \r\n"));
  const std::string_view page = target.substr(0, target.find('?'));
  const std::string_view query = target.substr(std::min(target.size(), page.size() + 1));
  if (page == "setting.cgi" || page == "comm.cgi") return write(page, query);
  const auto slot = slot_of(query, settings_.active_slot);
  if (!slot) return not_found();
  if (page == "netftapi2.xml") return xml_response(configuration_page(*this, *slot));
  if (page != "netftcalapi.xml") return not_found();
  return xml_response(calibration_page(*slot));
}

std::string NetBoxDevice::write(std::string_view page, std::string_view query) {
  if (writes_.count(ticks_) > kServedInASecond && settings_.quirks.only_three_writes) return found(page);
  NetBoxSettings wanted = settings_;
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), pair.size() + 1));
    const std::string_view name = pair.substr(0, pair.find('='));
    const std::string_view text = pair.substr(std::min(pair.size(), name.size() + 1));
    const auto value = text.size() <= kFloatCharacters ? parse_finite(text) : std::nullopt;
    if (value) write_variable(wanted, page, name, *value);
  }
  configure(wanted);
  return found(page);
}

void spoil_page(const Fault& fault, StreamReply& reply) {
  using K = FaultKind;
  std::string& page = reply.bytes;
  if (fault.is(K::http_slow)) reply.wait = std::max(reply.wait, fault.delay);
  if (fault.is(K::http_truncated)) page.resize(std::min(page.size(), static_cast<std::size_t>(fault.size)));
  if (fault.is(K::http_status))
    page = refusal(fmt::format("{} {}", fault.code, fault.code < 500 ? "Not Found" : "Internal Server Error"));
  if (fault.is(K::http_oversized)) page = xml_response("<?xml version=\"1.0\"?><netft>" + std::string(fault.size, ' '));
  if (fault.is(K::http_charset)) page = fault.utf16 ? in_utf_16(page) : in_latin_1(page);
  if (fault.is(K::http_missing_tag)) page = with_element(page, fault.tag, [](const std::string&) { return ""; });
  if (fault.is(K::http_duplicate_tag))
    page = with_element(page, fault.tag, [](const std::string& line) { return line + line; });
}

}  // namespace kphi::sim
