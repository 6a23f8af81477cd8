// What the box lets a person write: setting.cgi, comm.cgi, config.cgi, moncon.cgi (manual, CGI interface). Each page
// takes its own variables only. Values are clamped in silence, nonsense is ignored in silence, and the answer is 302.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

#include "drivers/sim/motor.hpp"
#include "drivers/sim/netbox_device.hpp"
#include "drivers/sim/netbox_pages.hpp"
#include "drivers/sim/netbox_units.hpp"

namespace kphi::sim {
namespace {

constexpr std::size_t kFloatCharacters = 20;
constexpr std::size_t kNameCharacters = 32, kUserCharacters = 16;
constexpr int kWritesServed = 3;

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
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || text.size() > kFloatCharacters) return std::nullopt;
  if (!std::isfinite(value)) return std::nullopt;
  return value;
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

/// "setbias3" with "setbias" -> 3; only below `count`.
std::optional<std::size_t> index_of(std::string_view name, std::string_view stem, std::size_t count) {
  if (name.substr(0, stem.size()) != stem || name.size() == stem.size()) return std::nullopt;
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(name.data() + stem.size(), name.data() + name.size(), index);
  if (error != std::errc{} || end != name.data() + name.size() || index >= count) return std::nullopt;
  return index;
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

}  // namespace

std::string NetBoxDevice::http(std::string_view request) {
  constexpr std::string_view kGet = "GET /";
  if (request.substr(0, kGet.size()) == kGet) {
    const std::string_view target =
        request.substr(kGet.size(), request.find_first_of(" \r\n", kGet.size()) - kGet.size());
    const std::size_t question = target.find('?');
    const std::string_view page = target.substr(0, question);
    for (const char* writable : {"setting.cgi", "comm.cgi", "config.cgi", "moncon.cgi"}) {
      if (page != writable) continue;
      return write(page, question == std::string_view::npos ? std::string_view() : target.substr(question + 1));
    }
  }
  return netbox_answer(*this, request);
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
  if (settings_.habits.only_three_writes && writes_ > kWritesServed) return found(page);
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

}  // namespace kphi::sim
