#include "drivers/serial/port.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <thread>
#include <utility>

#include "drivers/serial/discovery.hpp"

namespace kphi::serial {
namespace {

struct Rate {
  unsigned baud;
  speed_t code;
};
constexpr Rate kRates[] = {{1200, B1200},       {2400, B2400},       {4800, B4800},       {9600, B9600},
                           {19200, B19200},     {38400, B38400},     {57600, B57600},     {115200, B115200},
                           {230400, B230400},   {460800, B460800},   {500000, B500000},   {576000, B576000},
                           {921600, B921600},   {1000000, B1000000}, {1152000, B1152000}, {1500000, B1500000},
                           {2000000, B2000000}, {2500000, B2500000}, {3000000, B3000000}, {3500000, B3500000},
                           {4000000, B4000000}};

const Rate* rate_of(unsigned baud) noexcept {
  const auto found =
      std::find_if(std::begin(kRates), std::end(kRates), [&](const Rate& rate) { return rate.baud == baud; });
  return found == std::end(kRates) ? nullptr : found;
}

const Rate& known_rate(const std::string& device, unsigned baud) {
  if (const Rate* rate = rate_of(baud)) return *rate;
  std::vector<unsigned> known;
  for (const Rate& rate : kRates) known.push_back(rate.baud);
  throw DeviceError("serial port " + device, "open", fmt::format("{} baud is not a rate this system knows", baud),
                    fmt::format("use one of {}", fmt::join(known, ", ")));
}

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

void make_raw(int fd, const std::string& device, const Rate& rate) {
  termios line{};
  if (tcgetattr(fd, &line) != 0) refuse(device, "read line settings", errno);
  cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB);
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
  cfsetispeed(&line, rate.code);
  cfsetospeed(&line, rate.code);
  if (tcsetattr(fd, TCSANOW, &line) != 0) refuse(device, "set line raw", errno);
  // It may obey in part: that is no error to tcsetattr.
  termios now{};
  if (tcgetattr(fd, &now) != 0 || cfgetospeed(&now) != rate.code) {
    throw DeviceError("serial port " + device, fmt::format("set {} baud 8N1", rate.baud), "it keeps another rate",
                      "check that the adapter supports this rate");
  }
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

bool known_baud(unsigned baud) noexcept { return rate_of(baud) != nullptr; }

std::vector<std::string> stable_names() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/serial/by-id", none)) {
    names.push_back(entry.path().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Port::Port(const std::string& specification, unsigned baud) : device_(specification) {
  (void)known_rate(specification, baud);
  device_ = path_of(specification);
  Descriptor opened(open_exclusively(device_));
  fd_ = opened.get();
  apply(baud);
  tcflush(fd_, TCIOFLUSH);
  low_latency_ = ask_low_latency(fd_);
  fd_ = opened.release();
}

Port::~Port() {
  ioctl(fd_, TIOCNXCL);
  ::close(fd_);
}

std::size_t Port::read(std::span<std::uint8_t> into) {
  const auto n = ::read(fd_, into.data(), into.size());
  if (n > 0) return static_cast<std::size_t>(n);
  if (n < 0 && (errno == EAGAIN || errno == EINTR)) return 0;
  gone("read", n == 0 ? ENODEV : errno);
}

std::size_t Port::write(std::span<const std::uint8_t> bytes) {
  const auto n = ::write(fd_, bytes.data(), bytes.size());
  if (n >= 0) return static_cast<std::size_t>(n);
  if (errno == EAGAIN || errno == EINTR) return 0;
  gone("write", errno);
}

bool Port::wait(Duration wall) const noexcept {
  pollfd line{fd_, POLLIN, 0};
  const timespec limit{static_cast<time_t>(wall.count() / 1'000'000'000), wall.count() % 1'000'000'000};
  return wall >= Duration{0} && ppoll(&line, 1, &limit, nullptr) > 0;
}

std::size_t Port::unsent() const noexcept {
  int waiting = 0;
  return ioctl(fd_, TIOCOUTQ, &waiting) == 0 && waiting > 0 ? static_cast<std::size_t>(waiting) : 0;
}

void Port::drain(Duration wall) const noexcept {
  const auto end = std::chrono::steady_clock::now() + wall;
  while (unsent() > 0 && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void Port::set_baud(unsigned baud) {
  apply(baud);
  tcflush(fd_, TCIOFLUSH);
}

void Port::apply(unsigned baud) {
  make_raw(fd_, device_, known_rate(device_, baud));
  baud_ = baud;
}

void Port::gone(const char* operation, int error) const {
  throw PortGone("serial port " + device_, operation, fmt::format("it is gone ({}): unplugged?", std::strerror(error)),
                 "plug it in again");
}

}  // namespace kphi::serial
