// A /sys and a /dev of our own, laid out as the kernel does for USB serial adapters.
#pragma once

#include <fstream>
#include <string>

#include "drivers/serial/port.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::serial::fake {

struct UsbAdapter {
  std::string terminal;  ///< ttyUSB0
  std::string vendor, product, serial;
  std::string port = "1-1";
  int interface = 0;
  std::string latency_timer;  ///< empty: no such attribute
  std::string maker, name;
  std::string by_id;  ///< empty: udev gave none
};

class Sysfs {
 public:
  Sysfs() {
    std::filesystem::create_directories(sys() / "class/tty");
    std::filesystem::create_directories(dev() / "serial/by-id");
  }

  [[nodiscard]] Roots roots() const { return {sys(), dev()}; }

  void plug(const UsbAdapter& adapter) {
    const auto device = sys() / "devices/pci0000:00/0000:00:14.0/usb1" / adapter.port;
    const auto interface = device / (adapter.port + ":1." + std::to_string(adapter.interface));
    const auto port = interface / adapter.terminal;
    write(device / "idVendor", adapter.vendor);
    write(device / "idProduct", adapter.product);
    write(device / "serial", adapter.serial);
    write(device / "manufacturer", adapter.maker);
    write(device / "product", adapter.name);
    write(interface / "bInterfaceNumber", "0" + std::to_string(adapter.interface));
    write(port / "latency_timer", adapter.latency_timer);
    add_terminal(port / "tty" / adapter.terminal);
    if (!adapter.by_id.empty())
      std::filesystem::create_symlink("../../" + adapter.terminal, dev() / "serial/by-id" / adapter.by_id);
  }
  /// A port of the mainboard.
  void add_terminal(const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    std::filesystem::create_symlink(folder, sys() / "class/tty" / folder.filename());
    std::ofstream(dev() / folder.filename()) << "";
  }
  void unplug(const std::string& terminal) { std::filesystem::remove(sys() / "class/tty" / terminal); }
  [[nodiscard]] std::filesystem::path sys() const { return folder_.path() / "sys"; }
  [[nodiscard]] std::filesystem::path dev() const { return folder_.path() / "dev"; }

 private:
  static void write(const std::filesystem::path& file, const std::string& text) {
    if (text.empty()) return;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text << '\n';
  }

  test::TemporaryFolder folder_;
};

}  // namespace kphi::serial::fake
