// A serial line without hardware: a pseudo-terminal and the path under which the driver opens its other end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/descriptor.hpp"

namespace kphi::sim {

/// Both ends raw. The slave stays open here, so that a client may close its end without an error on this one.
class Pty {
 public:
  /// `device`: a symlink to create (with its folder); replaces an older symlink, nothing else. Empty: none.
  /// Throws DeviceError.
  /// `baud`: rate of the other end until its client sets one.
  explicit Pty(const std::string& device, unsigned baud = 115200);
  ~Pty();  ///< removes the symlink, if it is still ours

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] int number() const noexcept { return master_.number(); }
  /// Never blocks; 0 when nothing waits. Call it every millisecond: after a second without a byte it takes back an
  /// exclusive opening that a vanished client left behind.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> into) noexcept;
  /// Never blocks; bytes taken, fewer than given when the client does not read.
  [[nodiscard]] std::size_t write(std::span<const std::uint8_t> bytes) noexcept;
  /// Rate at which the client has set its end, bits per second; 0: one without a number.
  [[nodiscard]] unsigned baud() const noexcept;
  /// Pulls the adapter: the client sees a hang-up, and the link disappears. Its number stays taken, so that no other
  /// bench gets a number whose lock the client still holds.
  void unplug() noexcept;
  /// Another pseudo-terminal under the same link. Throws DeviceError.
  void plug();
  [[nodiscard]] bool plugged() const noexcept { return master_.number() >= 0; }

 private:
  std::string device_;
  unsigned baud_;
  std::string path_;
  std::string slave_path_;
  Descriptor master_;
  Descriptor slave_;
  int quiet_reads_ = 0;
  std::vector<Descriptor> gone_;  ///< slaves of pulled adapters
};

}  // namespace kphi::sim
