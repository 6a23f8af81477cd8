#include "drivers/serial/discovery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "base/error.hpp"
#include "base/number.hpp"

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

bool has(const fs::path& folder, const char* attribute) {
  std::error_code none;
  return fs::exists(folder / attribute, none);
}

/// From the terminal's folder up through the port, the interface and the device of USB.
std::optional<Adapter> look_up_from(fs::path folder, const Roots& roots) {
  Adapter adapter;
  adapter.device = roots.dev / folder.filename();
  for (; folder.has_relative_path(); folder = folder.parent_path()) {
    if (has(folder, "latency_timer"))
      adapter.latency_timer_ms = parse_integer<int>(attribute(folder / "latency_timer"), 10);
    if (has(folder, "bInterfaceNumber")) adapter.interface = folder.filename();
    if (has(folder, "idVendor")) break;
  }
  const auto vendor = parse_integer<std::uint16_t>(attribute(folder / "idVendor"), 16);
  const auto product = parse_integer<std::uint16_t>(attribute(folder / "idProduct"), 16);
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
  return UsbAddress{vendor, product, serial, serial.empty() ? socket() : ""}.text();
}

bool Adapter::fits(const UsbAddress& wanted) const {
  return wanted.fits(vendor, product, serial) &&
         (wanted.port_path.empty() || wanted.port_path == port || wanted.port_path == interface);
}

std::string Adapter::line() const {
  return fmt::format("{} is {}{} in socket {}", device.string(), specification(),
                     words.empty() ? "" : " (" + words + ")", socket());
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
  const auto wanted = UsbAddress::read(specification);
  if (!wanted) {
    refuse(specification, "not the address of a USB adapter",
           "write usb:VID:PID[:SERIAL][@PORT] or a path, as in usb:0403:6001:A10K0000");
  }
  const std::vector<Adapter> all = adapters(roots);
  std::vector<Adapter> fitting;
  std::copy_if(all.begin(), all.end(), std::back_inserter(fitting), [&](const Adapter& a) { return a.fits(*wanted); });
  if (fitting.size() == 1) return fitting.front().device.string();
  if (fitting.size() > 1) {
    refuse(specification, fmt::format("{} adapters fit: {}", fitting.size(), list(fitting)),
           fmt::format("add the serial number, or where there is none the socket, as in {}@{}",
                       specification.substr(0, specification.find('@')), fitting.front().interface));
  }
  if (all.empty()) refuse(specification, "no USB serial adapter is plugged in", "plug it in and try again");
  refuse(specification, "no adapter fits; found: " + list(all), "plug it in, or use one of these");
}

std::optional<Finding> judge_latency_timer(const Adapter& adapter) {
  if (!adapter.latency_timer_ms || *adapter.latency_timer_ms <= kShortTimerMs) return std::nullopt;
  const std::string name = adapter.device.filename();
  return Finding{
      Severity::warning,
      fmt::format("latency timer of adapter {}: replies are delayed by up to {} ms, about {:.0f} queries per second",
                  name, *adapter.latency_timer_ms, 1000.0 / *adapter.latency_timer_ms),
      fmt::format("as root: echo 1 > /sys/bus/usb-serial/devices/{}/latency_timer; permanently with the udev rule "
                  "SUBSYSTEM==\"usb-serial\", DRIVER==\"ftdi_sio\", ATTR{{latency_timer}}=\"1\"",
                  name)};
}

}  // namespace kphi::serial
