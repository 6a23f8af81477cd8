// A serial line without hardware: what is written to one end is read at the other.
#pragma once

#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace kphi::serial::fake {

class PseudoTerminal {
 public:
  PseudoTerminal() : master_(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0) throw std::runtime_error("no pseudo-terminal");
    char name[128];
    if (ptsname_r(master_, name, sizeof name) != 0) throw std::runtime_error("no name");
    name_ = name;
    slave_ = ::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);  // stays open, so that the master never sees a hang-up
    termios line{};
    tcgetattr(slave_, &line);
    cfmakeraw(&line);
    tcsetattr(slave_, TCSANOW, &line);
  }
  ~PseudoTerminal() {
    unplug();
    ::close(slave_);
  }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  /// What the driver opens.
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] int master() const { return master_; }
  [[nodiscard]] termios line() const {
    termios line{};
    tcgetattr(slave_, &line);
    return line;
  }
  /// As the host has set it.
  [[nodiscard]] unsigned baud() const {
    constexpr std::pair<speed_t, unsigned> rates[] = {
        {B9600, 9600},     {B19200, 19200},   {B38400, 38400},   {B57600, 57600},     {B115200, 115200},
        {B230400, 230400}, {B460800, 460800}, {B921600, 921600}, {B1000000, 1000000}, {B2000000, 2000000}};
    const termios now = line();
    for (const auto& [code, rate] : rates) {
      if (cfgetospeed(&now) == code) return rate;
    }
    return 0;
  }
  void unplug() {
    if (master_ >= 0) ::close(master_);
    master_ = -1;
  }

 private:
  int master_;
  int slave_ = -1;
  std::string name_;
};

}  // namespace kphi::serial::fake
