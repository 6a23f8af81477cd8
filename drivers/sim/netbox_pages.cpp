#include "drivers/sim/netbox_pages.hpp"

#include <fmt/format.h>

#include <charconv>
#include <iterator>
#include <optional>

#include "drivers/sim/motor.hpp"
#include "drivers/sim/netbox_device.hpp"
#include "drivers/sim/netbox_units.hpp"

namespace kphi::sim {
namespace {

std::string response(std::string_view status, std::string_view type, std::string_view body) {
  return fmt::format(
      "HTTP/1.0 {}\r\nServer: Net F/T\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}", status,
      type, body.size(), body);
}

std::string not_found() { return response("404 Not Found", "text/html", "<html><body>404 Not Found</body></html>"); }

/// One word per monitor condition.
template <class Word>
std::string conditions(const NetBoxSettings& settings, Word word) {
  std::string out;
  for (const MonitorCondition& condition : settings.conditions) {
    if (!out.empty()) out += settings.habits.array_separator;
    out += word(condition);
  }
  return out;
}

std::string torque_text(const NetBoxSettings& settings, int code) {
  const std::string plain(unit(kTorqueUnits, code).name);
  if (!settings.habits.torque_text_with_hyphen) return plain;
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

std::array<std::int64_t, 6> shown_bias(const NetBoxDevice& box) {
  std::array<std::int64_t, 6> bias{};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    bias[axis] = box.settings().bias_vector[axis];
    if (box.settings().habits.software_bias_in_setbias) bias[axis] += box.signal().software_bias()[axis] / 1000;
  }
  return bias;
}

/// The box's ENABL.
const char* enabled(const NetBoxSettings& settings, bool yes) {
  if (settings.habits.flags_as_digits) return yes ? "1" : "0";
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
  const std::string separator(1, settings.habits.array_separator);
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
  add("setbias", joined(shown_bias(box)));
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
  if (settings.habits.product_name) add("prodname", settings.habits.axia ? "Ethernet Axia" : "Net F/T");
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

/// "index=3" -> 3, "" -> the active one; nothing else is a slot.
std::optional<int> slot_of(std::string_view query, int active) {
  if (query.empty()) return active;
  constexpr std::string_view kIndex = "index=";
  if (query.substr(0, kIndex.size()) != kIndex) return std::nullopt;
  query.remove_prefix(kIndex.size());
  int slot = 0;
  const auto [end, error] = std::from_chars(query.data(), query.data() + query.size(), slot);
  if (error != std::errc{} || end != query.data() + query.size() || slot < 0 || slot >= kSlots) return std::nullopt;
  return slot;
}

}  // namespace

std::string netbox_answer(const NetBoxDevice& box, std::string_view request) {
  constexpr std::string_view kGet = "GET /";
  if (request.substr(0, kGet.size()) != kGet) return not_found();
  request.remove_prefix(kGet.size());
  const std::string_view target = request.substr(0, request.find_first_of(" \r\n"));
  const std::size_t question = target.find('?');
  const std::string_view page = target.substr(0, question);
  const std::string_view query = question == std::string_view::npos ? std::string_view() : target.substr(question + 1);
  const NetBoxSettings& settings = box.settings();
  const auto slot = slot_of(query, settings.active_slot);
  if (!slot) return not_found();
  if (page == "netftapi2.xml") return response("200 OK", "text/xml", configuration_page(box, *slot));
  if (page == "netftcalapi.xml") {
    const bool named = !query.empty();
    const int calibration = named ? *slot : settings.slots[static_cast<std::size_t>(*slot)].calibration;
    return response("200 OK", "text/xml", calibration_page(box, calibration));
  }
  return not_found();
}

}  // namespace kphi::sim
