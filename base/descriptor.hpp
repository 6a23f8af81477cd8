// A file descriptor that closes itself, and an event of one.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace kphi {

class Descriptor {
 public:
  Descriptor() = default;
  /// Takes it over; below 0: none.
  explicit Descriptor(int number) noexcept : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  /// -1: none.
  [[nodiscard]] int number() const noexcept { return number_; }

 private:
  int number_ = -1;
};

/// An event that wakes a thread out of poll(2): an eventfd.
class Wakeup {
 public:
  /// Throws std::system_error when the system has no more descriptors.
  Wakeup() : event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (event_.number() < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  /// Any thread, and a signal handler.
  void raise() noexcept { eventfd_write(event_.number(), 1); }
  /// False: it was not raised since the last clear().
  bool clear() noexcept {
    eventfd_t raised = 0;
    return eventfd_read(event_.number(), &raised) == 0;
  }
  /// Readable while raised.
  [[nodiscard]] int descriptor() const noexcept { return event_.number(); }

 private:
  Descriptor event_;
};

}  // namespace kphi
