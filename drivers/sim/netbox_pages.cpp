#include "drivers/sim/netbox_pages.hpp"

#include <fmt/format.h>

#include <charconv>
#include <iterator>
#include <optional>

#include "drivers/sim/motor.hpp"
#include "drivers/sim/netbox_device.hpp"

namespace kphi::sim {
namespace {

constexpr int kSlots = 16;

std::string response(std::string_view status, std::string_view type, std::string_view body) {
  return fmt::format(
      "HTTP/1.0 {}\r\nServer: Net F/T\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}", status,
      type, body.size(), body);
}

std::string not_found() { return response("404 Not Found", "text/html", "<html><body>404 Not Found</body></html>"); }

template <class Values>
std::string joined(const Values& values) {
  return fmt::format("{}", fmt::join(values, ";"));
}

/// Sixteen times the same: the monitor conditions, of which none is set.
std::string sixteen(std::string_view value) {
  std::string out(value);
  for (int i = 1; i < kSlots; ++i) out.append(";").append(value);
  return out;
}

std::string configuration_page(const NetBoxDevice& box, int slot) {
  const NetBoxSettings& settings = box.settings();
  const bool calibrated = slot == 0;
  std::string page = "<?xml version=\"1.0\"?><netft>\n";
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
  add("cfgcalsel", slot);
  add("cfgcalsn", calibrated ? settings.serial : "FT0000");
  add("scfgfu", "N");
  add("scfgtu", "Nm");
  add("cfgtfx", "0;0;0;0;0;0");
  add("scfgtdu", "mm");
  add("scfgtau", "degrees");
  add("cfgcpf", calibrated ? settings.counts_per_force : 0);
  add("cfgcpt", calibrated ? settings.counts_per_torque : 0);
  add("cfgmr", joined(calibrated ? settings.range : Wrench{}));
  add("cfgusra", "empty");
  add("cfgusrb", "empty");
  add("setcfgsel", 0);
  add("setpke", 1);
  add("setmce", 0);
  add("setbias", "0;0;0;0;0;0");
  add("mce", sixteen("0"));
  add("mcx", sixteen("-1"));
  add("mcc", sixteen("1"));
  add("mcv", sixteen("0"));
  add("mco", sixteen("0x00"));
  add("setuserfilter", 0);
  add("nethwaddr", "00:16:BD:00:00:01");
  add("netip", settings.address);
  add("comnetip", settings.address);
  add("comnetdhcp", "Disabled");
  add("comrdte", "Enabled");
  add("comrdtrate", kTicksPerSecond / box.divisor());
  add("comrdtbsiz", settings.records_per_datagram);
  add("mfgdigsn", "LOT0001");
  add("mfgdigver", "2.2.59");
  add("prodname", "Net F/T");
  return page + "</netft>\n";
}

std::string calibration_page(const NetBoxDevice& box, int slot) {
  const NetBoxSettings& settings = box.settings();
  const bool calibrated = slot == 0;
  return fmt::format(
      "<?xml version=\"1.0\"?><netftCalibration>\n<calsn>{}</calsn>\n<calcpf>{}</calcpf>\n<calcpt>{}</calcpt>\n"
      "</netftCalibration>\n",
      calibrated ? settings.serial : "FT0000", calibrated ? settings.counts_per_force : 0,
      calibrated ? settings.counts_per_torque : 0);
}

/// "index=3" -> 3, "" -> 0 (the active slot); nothing else is a slot.
std::optional<int> slot_of(std::string_view query) {
  if (query.empty()) return 0;
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
  const auto slot = slot_of(question == std::string_view::npos ? std::string_view() : target.substr(question + 1));
  if (!slot) return not_found();
  if (page == "netftapi2.xml") return response("200 OK", "text/xml", configuration_page(box, *slot));
  if (page == "netftcalapi.xml") return response("200 OK", "text/xml", calibration_page(box, *slot));
  return not_found();
}

}  // namespace kphi::sim
