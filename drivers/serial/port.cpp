#include "drivers/serial/port.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>

#include "base/number.hpp"

namespace kphi::serial {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kRates[] = {1200,    2400,    4800,    9600,    19200,   38400,   57600,
                               115200,  230400,  460800,  500000,  576000,  921600,  1000000,
                               1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};

void require_known(const std::string& device, unsigned baud) {
  if (std::ranges::find(kRates, baud) != std::end(kRates)) return;
  throw DeviceError("serial port " + device, "open", fmt::format("unknown baud rate {}", baud),
                    fmt::format("use one of {}", fmt::join(kRates, ", ")));
}

std::string advice_for_missing() {
  const std::vector<std::string> names = stable_names();
  if (names.empty()) return "no serial adapter found (/dev/serial/by-id is empty); plug it in and try again";
  return fmt::format("available: {}", fmt::join(names, ", "));
}

std::string advice_for(int error, const std::string& device) {
  if (error == ENOENT || error == ENODEV || error == ENXIO) return advice_for_missing();
  if (error == EACCES || error == EPERM)
    return "join the group dialout (usermod -aG dialout $USER as root) and log in again";
  if (error == EBUSY || error == EWOULDBLOCK)
    return fmt::format("close the other program; `fuser -v {}` names it", device);
  return "check the device and its cable";
}

std::string words_for(int error) {
  if (error == ENOTTY) return "not a serial port";
  if (error == EBUSY || error == EWOULDBLOCK) return "in use by another program";
  return std::strerror(error);
}

[[noreturn]] void refuse(const std::string& device, const char* operation, int error) {
  throw DeviceError("serial port " + device, operation, words_for(error), advice_for(error, device));
}

void make_raw(int fd, const std::string& device, unsigned baud) {
  termios line{};
  if (tcgetattr(fd, &line) != 0) refuse(device, "read line settings", errno);
  cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB);
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
  cfsetspeed(&line, baud);
  if (tcsetattr(fd, TCSANOW, &line) != 0) refuse(device, "set line raw", errno);
  // tcsetattr reports success even if it has applied only a part.
  if (!runs_at(fd, baud)) {
    throw DeviceError("serial port " + device, fmt::format("set {} baud 8N1", baud), "the port keeps another rate",
                      "check that the adapter supports this rate");
  }
}

/// To have bytes handed over at once. Most USB adapters' drivers and pseudo-terminals ignore it.
void ask_low_latency(int fd) noexcept {
  serial_struct settings{};
  if (ioctl(fd, TIOCGSERIAL, &settings) != 0) return;
  settings.flags |= ASYNC_LOW_LATENCY;
  ioctl(fd, TIOCSSERIAL, &settings);
}

Descriptor open_exclusively(const std::string& device) {
  Descriptor port(::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (port.number() < 0) refuse(device, "open", errno);
  if (isatty(port.number()) == 0) refuse(device, "open", ENOTTY);
  if (flock(port.number(), LOCK_EX | LOCK_NB) != 0) refuse(device, "lock", errno);
  if (ioctl(port.number(), TIOCEXCL) != 0) refuse(device, "open exclusively", errno);
  return port;
}

}  // namespace

bool runs_at(int descriptor, unsigned baud) noexcept {
  termios wanted{}, line{};
  return cfsetspeed(&wanted, baud) == 0 && tcgetattr(descriptor, &line) == 0 &&
         cfgetospeed(&line) == cfgetospeed(&wanted);
}

std::vector<std::string> stable_names() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator("/dev/serial/by-id", none)) {
    names.push_back(entry.path().string());
  }
  std::ranges::sort(names);
  return names;
}

Port::Port(const std::string& specification, unsigned baud) : device_(specification) {
  require_known(specification, baud);
  device_ = path_of(specification);
  port_ = open_exclusively(device_);
  apply(baud);
  tcflush(fd(), TCIOFLUSH);
  ask_low_latency(fd());
}

Port::~Port() { ioctl(fd(), TIOCNXCL); }

std::size_t Port::read(std::span<std::uint8_t> into) {
  const auto n = ::read(fd(), into.data(), into.size());
  if (n > 0) return static_cast<std::size_t>(n);
  if (n < 0 && (errno == EAGAIN || errno == EINTR)) return 0;
  gone("read", n == 0 ? ENODEV : errno);
}

std::size_t Port::write(std::span<const std::uint8_t> bytes) {
  const auto n = ::write(fd(), bytes.data(), bytes.size());
  if (n >= 0) return static_cast<std::size_t>(n);
  if (errno == EAGAIN || errno == EINTR) return 0;
  gone("write", errno);
}

bool Port::wait(Duration wall) const noexcept {
  pollfd line{fd(), POLLIN, 0};
  const timespec limit = to_timespec(wall);
  return wall >= Duration{0} && ppoll(&line, 1, &limit, nullptr) > 0;
}

std::size_t Port::unsent() const noexcept {
  int waiting = 0;
  return ioctl(fd(), TIOCOUTQ, &waiting) == 0 && waiting > 0 ? static_cast<std::size_t>(waiting) : 0;
}

void Port::drain(Duration wall) const noexcept {
  const auto end = std::chrono::steady_clock::now() + wall;
  while (unsent() > 0 && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void Port::set_baud(unsigned baud) {
  apply(baud);
  tcflush(fd(), TCIOFLUSH);
}

void Port::apply(unsigned baud) {
  require_known(device_, baud);
  make_raw(fd(), device_, baud);
  baud_ = baud;
}

void Port::gone(const char* operation, int error) const {
  throw PortGone("serial port " + device_, operation,
                 fmt::format("the port is gone, probably unplugged ({})", std::strerror(error)),
                 "plug the adapter in again");
}

namespace {

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
    const auto found = std::ranges::find(adapters, path, &Adapter::device);
    if (found != adapters.end()) return &*found;
    const fs::path target = fs::read_symlink(path, none);
    if (none) break;
    path = (path.parent_path() / target).lexically_normal();
  }
  return nullptr;
}

std::string list(const std::vector<Adapter>& adapters) {
  std::string text;
  for (const Adapter& adapter : adapters) text += (text.empty() ? "" : ", ") + adapter.line();
  return text;
}

[[noreturn]] void not_found(const std::string& specification, const std::string& cause, const std::string& next_move) {
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
  std::ranges::sort(found, {}, &Adapter::device);
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
    not_found(specification, "not the address of a USB adapter",
              "write usb:VID:PID[:SERIAL][@PORT] or a path, as in usb:0403:6001:A10K0000");
  }
  const std::vector<Adapter> all = adapters(roots);
  std::vector<Adapter> fitting;
  std::copy_if(all.begin(), all.end(), std::back_inserter(fitting), [&](const Adapter& a) { return a.fits(*wanted); });
  if (fitting.size() == 1) return fitting.front().device.string();
  if (fitting.size() > 1) {
    not_found(specification, fmt::format("{} adapters fit: {}", fitting.size(), list(fitting)),
              fmt::format("add the serial number, or where there is none the socket, as in {}@{}",
                          specification.substr(0, specification.find('@')), fitting.front().interface));
  }
  if (all.empty()) not_found(specification, "no USB serial adapter is plugged in", "plug it in and try again");
  not_found(specification, "no adapter fits; found: " + list(all), "plug it in, or use one of these");
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
