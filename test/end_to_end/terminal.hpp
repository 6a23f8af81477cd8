// A terminal at which a test types: the standard input of a program that asks.
#pragma once

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

namespace kphi::test {

class Terminal {
 public:
  Terminal() : typist_(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (typist_ < 0 || grantpt(typist_) != 0 || unlockpt(typist_) != 0) throw std::runtime_error("no terminal");
    program_ = open(ptsname(typist_), O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (program_ < 0) throw std::runtime_error("no terminal to type at");
  }
  ~Terminal() {
    close(program_);
    close(typist_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// Enter included.
  void type(const std::string& line) const { press(line + "\n"); }
  void press(const std::string& keys) const {
    if (::write(typist_, keys.data(), keys.size()) < 0) throw std::runtime_error("cannot type");
  }
  /// To be the program's standard input.
  [[nodiscard]] int descriptor() const { return program_; }

 private:
  int typist_ = -1;
  int program_ = -1;
};

}  // namespace kphi::test
