// A USB in user space by libumockdev: programs that were started with its preloaded library and this environment see
// these devices through the true libusb, and no others.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/sim/usb/function.hpp"

namespace kphi::sim {

class VirtualUsb {
 public:
  /// Throws std::runtime_error when this process was not started under umockdev-wrapper.
  VirtualUsb();
  ~VirtualUsb();
  VirtualUsb(const VirtualUsb&) = delete;
  VirtualUsb& operator=(const VirtualUsb&) = delete;

  /// True in a process that was started with the preloaded library.
  [[nodiscard]] static bool available() noexcept;

  /// At socket `port` (1..) of bus 1. The function must outlive its stay; it is called on the bus's thread. Both may be
  /// called by any thread.
  void plug(int port, UsbFunction& function);
  void unplug(int port);
  /// What another program needs in its environment, besides the preloaded library: UMOCKDEV_DIR.
  [[nodiscard]] std::string directory() const;

 private:
  class Socket;
  struct Bed;
  std::unique_ptr<Bed> bed_;
};

}  // namespace kphi::sim
