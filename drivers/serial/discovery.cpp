#include "drivers/serial/discovery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>

#include "drivers/device_error.hpp"

namespace kphi::serial {
namespace {

namespace fs = std::filesystem;

constexpr int kShortTimerMs = 4;  ///< a round trip beyond this makes lock-step asking slow

/// First line of a sysfs attribute; empty when there is none.
std::string attribute(const fs::path& file) {
  std::string text;
  std::getline(std::ifstream(file), text);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\r')) text.pop_back();
  return text;
}

template <class Number>
std::optional<Number> number(const std::string& text, int base) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Four hexadecimal digits, or '*' for any.
bool read_id(const std::string& text, std::optional<std::uint16_t>& id) {
  if (text == "*") return true;
  if (text.size() == 4) id = number<std::uint16_t>(text, 16);
  return id.has_value();
}

/// "1-1.2", or with an interface "1-1.2:1.0".
bool is_socket(const std::string& text) {
  if (text.empty() || text.find_first_not_of("0123456789-.:") != std::string::npos) return false;
  const auto dash = text.find('-');
  return dash != 0 && dash != std::string::npos && dash == text.rfind('-') && dash + 1 < text.size() &&
         text.find(':') == text.rfind(':');
}

bool has(const fs::path& folder, const char* attribute) {
  std::error_code none;
  return fs::exists(folder / attribute, none);
}

/// From the terminal's folder up through the port, the interface and the device of USB.
std::optional<Adapter> look_up_from(fs::path folder, const Roots& roots) {
  Adapter adapter;
  adapter.device = roots.dev / folder.filename();
  for (; folder.has_relative_path(); folder = folder.parent_path()) {
    if (has(folder, "latency_timer")) adapter.latency_timer_ms = number<int>(attribute(folder / "latency_timer"), 10);
    if (has(folder, "bInterfaceNumber")) adapter.interface = folder.filename();
    if (has(folder, "idVendor")) break;
  }
  const auto vendor = number<std::uint16_t>(attribute(folder / "idVendor"), 16);
  const auto product = number<std::uint16_t>(attribute(folder / "idProduct"), 16);
  if (!vendor || !product) return std::nullopt;
  adapter.vendor = *vendor;
  adapter.product = *product;
  adapter.serial = attribute(folder / "serial");
  adapter.port = folder.filename();
  const std::string maker = attribute(folder / "manufacturer"), name = attribute(folder / "product");
  adapter.words = maker + (maker.empty() || name.empty() ? "" : " ") + name;
  return adapter;
}

/// The one whose terminal `path` is, or links to in a few steps.
Adapter* follow(fs::path path, std::vector<Adapter>& adapters) {
  std::error_code none;
  for (int hops = 0; hops < 8; ++hops) {
    for (Adapter& adapter : adapters) {
      if (adapter.device == path) return &adapter;
    }
    const fs::path target = fs::read_symlink(path, none);
    if (none) break;
    path = (path.parent_path() / target).lexically_normal();
  }
  return nullptr;
}

void name_by_id(std::vector<Adapter>& adapters, const Roots& roots) {
  std::error_code none;
  for (const auto& link : fs::directory_iterator(roots.dev / "serial/by-id", none)) {
    if (Adapter* adapter = follow(link.path(), adapters)) adapter->by_id = link.path();
  }
}

std::string list(const std::vector<Adapter>& adapters) {
  std::string text;
  for (const Adapter& adapter : adapters) text += (text.empty() ? "" : ", ") + adapter.line();
  return text;
}

[[noreturn]] void refuse(const std::string& specification, const std::string& cause, const std::string& next_move) {
  throw DeviceError("serial port " + specification, "find", cause, next_move);
}

}  // namespace

std::string Adapter::specification() const {
  const std::string place = interface.empty() ? port : interface;
  return fmt::format("usb:{:04x}:{:04x}{}", vendor, product, serial.empty() ? "@" + place : ":" + serial);
}

std::string Adapter::line() const {
  return fmt::format("{} is {}{} in socket {}", device.string(), specification(),
                     words.empty() ? "" : " (" + words + ")", interface.empty() ? port : interface);
}

std::optional<Wanted> Wanted::parse(const std::string& specification) {
  if (!specification.starts_with("usb:")) return std::nullopt;
  std::string rest = specification.substr(4);
  Wanted wanted;
  if (const auto at = rest.rfind('@'); at != std::string::npos && is_socket(rest.substr(at + 1))) {
    wanted.port = rest.substr(at + 1);
    rest.resize(at);
  }
  const auto colon = rest.find(':');
  if (colon == std::string::npos) return std::nullopt;
  const auto second = rest.find(':', colon + 1);
  if (second != std::string::npos) {
    wanted.serial = rest.substr(second + 1);
    if (wanted.serial.empty() || wanted.serial[0] == ':' || wanted.serial[0] == '@') return std::nullopt;
    rest.resize(second);
  }
  if (!read_id(rest.substr(0, colon), wanted.vendor)) return std::nullopt;
  if (!read_id(rest.substr(colon + 1), wanted.product)) return std::nullopt;
  return wanted;
}

bool Wanted::fits(const Adapter& adapter) const {
  return (!vendor || *vendor == adapter.vendor) && (!product || *product == adapter.product) &&
         (serial.empty() || serial == adapter.serial) &&
         (port.empty() || port == adapter.port || port == adapter.interface);
}

std::vector<Adapter> adapters(const Roots& roots) {
  std::vector<Adapter> found;
  std::error_code none;
  for (const auto& terminal : fs::directory_iterator(roots.sys / "class/tty", none)) {
    const fs::path folder = fs::canonical(terminal.path(), none);
    if (none) continue;
    if (auto adapter = look_up_from(folder, roots)) found.push_back(std::move(*adapter));
  }
  std::sort(found.begin(), found.end(), [](const Adapter& a, const Adapter& b) { return a.device < b.device; });
  name_by_id(found, roots);
  return found;
}

std::optional<Adapter> adapter_of(const fs::path& device, const Roots& roots) {
  std::vector<Adapter> all = adapters(roots);
  Adapter* found = follow(device, all);
  return found == nullptr ? std::nullopt : std::optional(std::move(*found));
}

std::string path_of(const std::string& specification, const Roots& roots) {
  if (!specification.starts_with("usb:")) return specification;
  const auto wanted = Wanted::parse(specification);
  if (!wanted) {
    refuse(specification, "this is no specification of a USB adapter",
           "write usb:VID:PID[:SERIAL][@PORT] or a path, as in usb:0403:6001:A10K0000");
  }
  const std::vector<Adapter> all = adapters(roots);
  std::vector<Adapter> fitting;
  std::copy_if(all.begin(), all.end(), std::back_inserter(fitting), [&](const Adapter& a) { return wanted->fits(a); });
  if (fitting.size() == 1) return fitting.front().device.string();
  if (fitting.size() > 1) {
    refuse(specification, fmt::format("{} adapters fit: {}", fitting.size(), list(fitting)),
           fmt::format("add the serial number, or where there is none the socket, as in {}@{}",
                       specification.substr(0, specification.find('@')), fitting.front().interface));
  }
  if (all.empty()) refuse(specification, "no USB serial adapter is plugged in", "plug it in and try again");
  refuse(specification, "no adapter fits; there are: " + list(all), "plug it in, or name one of these");
}

std::optional<Finding> judge_latency_timer(const Adapter& adapter) {
  if (!adapter.latency_timer_ms || *adapter.latency_timer_ms <= kShortTimerMs) return std::nullopt;
  const std::string name = adapter.device.filename();
  return Finding{
      Severity::warning,
      fmt::format("the adapter {} holds replies back for up to {} ms (its latency timer): about {:.0f} questions per "
                  "second, one at a time",
                  name, *adapter.latency_timer_ms, 1000.0 / *adapter.latency_timer_ms),
      fmt::format("as root: echo 1 > /sys/bus/usb-serial/devices/{}/latency_timer; for good, the udev rule "
                  "SUBSYSTEM==\"usb-serial\", DRIVER==\"ftdi_sio\", ATTR{{latency_timer}}=\"1\"",
                  name)};
}

}  // namespace kphi::serial
