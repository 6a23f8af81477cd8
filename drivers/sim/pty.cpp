#include "drivers/sim/pty.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "drivers/device_error.hpp"

namespace kphi::sim {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& path, const std::string& operation, const std::string& cause,
                         const std::string& next_move = {}) {
  throw DeviceError("simulated motor " + path, operation, cause, next_move);
}

void make_raw(int descriptor) noexcept {
  termios line{};
  if (tcgetattr(descriptor, &line) != 0) return;
  cfmakeraw(&line);
  tcsetattr(descriptor, TCSANOW, &line);
}

void link(const std::string& device, const std::string& slave) {
  std::error_code error;
  const fs::path path(device);
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  const auto found = fs::symlink_status(path, error);
  if (fs::is_symlink(found)) fs::remove(path, error);
  if (fs::exists(found) && !fs::is_symlink(found)) {
    refuse(device, "create link", "something else stands there", "name another iq.device in the bench file");
  }
  fs::create_symlink(slave, path, error);
  if (error) refuse(device, "create link", error.message(), "name an iq.device in a folder that you may write");
}

}  // namespace

Pty::Pty(const std::string& device)
    : path_(device), master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
  std::array<char, 128> name{};
  if (master_.number() < 0 || ::grantpt(master_.number()) != 0 || ::unlockpt(master_.number()) != 0 ||
      ::ptsname_r(master_.number(), name.data(), name.size()) != 0) {
    refuse(device, "open pseudo-terminal", std::strerror(errno));
  }
  slave_path_ = name.data();
  slave_ = Descriptor(::open(name.data(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (slave_.number() < 0) refuse(slave_path_, "open", std::strerror(errno));
  make_raw(slave_.number());
  if (device.empty()) {
    path_ = slave_path_;
  } else {
    link(device, slave_path_);
  }
}

Pty::~Pty() {
  std::error_code error;
  if (path_ != slave_path_ && fs::read_symlink(path_, error) == fs::path(slave_path_)) fs::remove(path_, error);
}

std::size_t Pty::read(std::span<std::uint8_t> into) noexcept {
  const ssize_t count = ::read(master_.number(), into.data(), into.size());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

std::size_t Pty::write(std::span<const std::uint8_t> bytes) noexcept {
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t count = ::write(master_.number(), bytes.data() + written, bytes.size() - written);
    if (count <= 0) break;
    written += static_cast<std::size_t>(count);
  }
  return written;
}

void Pty::unlock() noexcept { ::ioctl(slave_.number(), TIOCNXCL); }

}  // namespace kphi::sim
