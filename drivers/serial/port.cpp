#include "drivers/serial/port.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <utility>

#include "drivers/device_error.hpp"
#include "drivers/serial/discovery.hpp"

namespace kphi::serial {
namespace {

constexpr unsigned kBauds[] = {1200,    2400,    4800,    9600,    19200,   38400,   57600,
                               115200,  230400,  460800,  500000,  576000,  921600,  1000000,
                               1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};

std::string advice_for_missing() {
  const std::vector<std::string> names = stable_names();
  if (names.empty()) return "no serial adapter is plugged in (/dev/serial/by-id is empty); plug it in and try again";
  return fmt::format("these are there: {}", fmt::join(names, ", "));
}

std::string advice_for(int error, const std::string& device) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return advice_for_missing();
    case EACCES:
    case EPERM:
      return "join the group dialout (usermod -aG dialout $USER as root) and log in again";
    case EBUSY:
    case EWOULDBLOCK:
      return fmt::format("close the other program; 'fuser -v {}' names it", device);
    default:
      return "check the device and its cable";
  }
}

std::string words_for(int error) {
  if (error == ENOTTY) return "it is no serial port";
  if (error == EBUSY || error == EWOULDBLOCK) return "it is in use by another program";
  return std::strerror(error);
}

[[noreturn]] void refuse(const std::string& device, const char* operation, int error) {
  throw DeviceError("serial port " + device, operation, words_for(error), advice_for(error, device));
}

/// Closes unless released.
class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const noexcept { return fd_; }
  int release() noexcept { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

void make_raw(int fd, const std::string& device) {
  termios line{};
  if (tcgetattr(fd, &line) != 0) refuse(device, "read line settings", errno);
  cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB);
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
  if (tcsetattr(fd, TCSANOW, &line) != 0) refuse(device, "set line raw", errno);
}

bool ask_low_latency(int fd) noexcept {
  serial_struct settings{};
  if (ioctl(fd, TIOCGSERIAL, &settings) != 0) return false;
  settings.flags |= ASYNC_LOW_LATENCY;
  return ioctl(fd, TIOCSSERIAL, &settings) == 0;
}

int open_exclusively(const std::string& device) {
  Descriptor port(::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (port.get() < 0) refuse(device, "open", errno);
  if (isatty(port.get()) == 0) refuse(device, "open", ENOTTY);
  if (flock(port.get(), LOCK_EX | LOCK_NB) != 0) refuse(device, "lock", errno);
  if (ioctl(port.get(), TIOCEXCL) != 0) refuse(device, "open exclusively", errno);
  return port.release();
}

}  // namespace

bool known_baud(unsigned baud) noexcept {
  return std::find(std::begin(kBauds), std::end(kBauds), baud) != std::end(kBauds);
}

std::vector<std::string> stable_names() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/serial/by-id", none)) {
    names.push_back(entry.path().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Port::Port(boost::asio::io_context& io, const std::string& specification, unsigned baud)
    : device_(specification), stream_(io) {
  if (!known_baud(baud)) {
    throw DeviceError("serial port " + specification, "open",
                      fmt::format("{} baud is not a rate this system knows", baud),
                      fmt::format("use one of {}", fmt::join(kBauds, ", ")));
  }
  device_ = path_of(specification);
  stream_.assign(open_exclusively(device_));
  try {
    make_raw(native_handle(), device_);
    using boost::asio::serial_port_base;
    stream_.set_option(serial_port_base::baud_rate(baud));
    stream_.set_option(serial_port_base::character_size(8));
    stream_.set_option(serial_port_base::parity(serial_port_base::parity::none));
    stream_.set_option(serial_port_base::stop_bits(serial_port_base::stop_bits::one));
    stream_.set_option(serial_port_base::flow_control(serial_port_base::flow_control::none));
  } catch (const boost::system::system_error& error) {
    ioctl(native_handle(), TIOCNXCL);
    throw DeviceError("serial port " + device_, fmt::format("set {} baud 8N1", baud), error.code().message(),
                      "check that the adapter supports this rate");
  } catch (...) {
    ioctl(native_handle(), TIOCNXCL);
    throw;
  }
  tcflush(native_handle(), TCIOFLUSH);
  low_latency_ = ask_low_latency(native_handle());
}

Port::~Port() {
  if (stream_.is_open()) ioctl(native_handle(), TIOCNXCL);
}

}  // namespace kphi::serial
