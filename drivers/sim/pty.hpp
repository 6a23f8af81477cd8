// A serial line without hardware: a pseudo-terminal and the path under which the driver opens its other end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/sim/descriptor.hpp"

namespace kphi::sim {

/// Both ends raw. The slave stays open here, so that a client's close is no error on this side.
class Pty {
 public:
  /// `device`: a symlink to create (with its folder); replaces an older symlink, nothing else. Empty: none.
  /// Throws DeviceError.
  explicit Pty(const std::string& device);
  ~Pty();  ///< removes the symlink, if it is still ours
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] int number() const noexcept { return master_.number(); }
  /// Never blocks; 0 when nothing waits.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> into) noexcept;
  /// Never blocks; bytes taken, fewer than given when the client does not read.
  [[nodiscard]] std::size_t write(std::span<const std::uint8_t> bytes) noexcept;
  /// Takes back an exclusive opening (TIOCEXCL) that a vanished client left behind.
  void unlock() noexcept;

 private:
  std::string path_;
  std::string slave_path_;
  Descriptor master_;
  Descriptor slave_;
};

}  // namespace kphi::sim
