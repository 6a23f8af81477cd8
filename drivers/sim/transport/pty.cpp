#include "drivers/sim/transport/pty.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "base/error.hpp"

namespace kphi::sim {
namespace {

namespace fs = std::filesystem;

constexpr int kQuietReads = 1000;  // a second of them, one per millisecond

[[noreturn]] void refuse(const std::string& path, const std::string& operation, const std::string& cause,
                         const std::string& next_move = {}) {
  throw DeviceError("simulated motor " + path, operation, cause, next_move);
}

constexpr unsigned kRates[] = {9600,   19200,   38400,   57600,   115200,  230400,  460800,  500000,  576000,
                               921600, 1000000, 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};

void make_raw(int descriptor, unsigned baud) noexcept {
  termios line{};
  if (tcgetattr(descriptor, &line) != 0) return;
  cfmakeraw(&line);
  cfsetspeed(&line, baud);
  tcsetattr(descriptor, TCSANOW, &line);
}

void link(const std::string& device, const std::string& slave) {
  std::error_code error;
  const fs::path path(device);
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  const auto found = fs::symlink_status(path, error);
  if (fs::is_symlink(found)) fs::remove(path, error);
  if (fs::exists(found) && !fs::is_symlink(found)) {
    refuse(device, "create link", "something other than a link exists there",
           "name another iq.device in the bench file");
  }
  fs::create_symlink(slave, path, error);
  if (error) refuse(device, "create link", error.message(), "name an iq.device in a folder that you may write");
}

}  // namespace

Pty::Pty(const std::string& device, unsigned baud) : device_(device), baud_(baud) { plug(); }

Pty::~Pty() { unplug(); }

void Pty::plug() {
  Descriptor master(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  std::array<char, 128> name{};
  if (master.number() < 0 || ::grantpt(master.number()) != 0 || ::unlockpt(master.number()) != 0 ||
      ::ptsname_r(master.number(), name.data(), name.size()) != 0) {
    refuse(device_, "open pseudo-terminal", std::strerror(errno));
  }
  Descriptor slave(::open(name.data(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (slave.number() < 0) refuse(name.data(), "open", std::strerror(errno));
  make_raw(slave.number(), baud_);
  slave_path_ = name.data();
  path_ = device_.empty() ? slave_path_ : device_;
  if (!device_.empty()) link(device_, slave_path_);
  master_ = std::move(master);
  slave_ = std::move(slave);
}

void Pty::unplug() noexcept {
  std::error_code error;
  if (path_ != slave_path_ && fs::read_symlink(path_, error) == fs::path(slave_path_)) fs::remove(path_, error);
  if (plugged()) gone_.push_back(std::move(slave_));
  master_ = Descriptor();
}

unsigned Pty::baud() const noexcept {
  termios line{};
  if (tcgetattr(slave_.number(), &line) != 0) return 0;
  for (const unsigned rate : kRates) {
    termios known{};
    if (cfsetspeed(&known, rate) == 0 && cfgetospeed(&known) == cfgetospeed(&line)) return rate;
  }
  return 0;
}

std::size_t Pty::read(std::span<std::uint8_t> into) noexcept {
  const ssize_t count = ::read(master_.number(), into.data(), into.size());
  quiet_reads_ = count > 0 ? 0 : quiet_reads_ + 1;
  // The client has left; an exclusive opening (TIOCEXCL) outlives one that vanished.
  if (quiet_reads_ == kQuietReads) ::ioctl(slave_.number(), TIOCNXCL);
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

}  // namespace kphi::sim
