// Where a program may say something, and that a test can block: a terminal that is stopped as by Ctrl-S, or a terminal
// or pipe that nobody reads and that is full.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <ostream>
#include <stdexcept>
#include <string>

#include "test/temporary_folder.hpp"

namespace kphi::test {

class BlockableOutput {
 public:
  enum class Kind { stopped_terminal, full_terminal, full_pipe };

  explicit BlockableOutput(Kind kind) : kind_(kind) {
    if (kind == Kind::full_pipe) {
      path_ = (folder_.path() / "pipe").string();
      if (::mkfifo(path_.c_str(), 0600) != 0) throw std::runtime_error("no pipe");
      reader_ = ::open(path_.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
      writer_ = ::open(path_.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    } else {
      reader_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
      std::array<char, 128> name{};
      if (reader_ < 0 || ::grantpt(reader_) != 0 || ::unlockpt(reader_) != 0 ||
          ::ptsname_r(reader_, name.data(), name.size()) != 0)
        throw std::runtime_error("no terminal");
      path_ = name.data();
      writer_ = ::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    }
  }
  ~BlockableOutput() {
    ::close(reader_);
    ::close(writer_);
  }
  BlockableOutput(const BlockableOutput&) = delete;
  BlockableOutput& operator=(const BlockableOutput&) = delete;

  /// What the program opens.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// From now on it takes nothing more, or all but nothing.
  void block() {
    if (kind_ == Kind::stopped_terminal) {
      if (::tcflow(writer_, TCOOFF) != 0) throw std::runtime_error("the terminal cannot be stopped");
      return;
    }
    // A terminal moves bytes on within itself for a while, which makes room again.
    const auto now = [] { return std::chrono::steady_clock::now(); };
    for (auto last = now(); now() - last < std::chrono::milliseconds(100); ::poll(nullptr, 0, 2)) {
      if (fill()) last = now();
    }
  }
  /// A stopped terminal goes on.
  void resume() { (void)::tcflow(writer_, TCOON); }
  /// All that has come so far.
  const std::string& read() {
    std::array<char, 4096> buffer{};
    for (ssize_t n = 0; (n = ::read(reader_, buffer.data(), buffer.size())) > 0;)
      read_.append(buffer.data(), static_cast<std::size_t>(n));
    return read_;
  }

 private:
  /// False: there was no room.
  [[nodiscard]] bool fill() const {
    const std::string filling(4096, '.');
    bool has_room = false;
    for (std::size_t n = filling.size(); n > 0; n /= 2) {
      while (::write(writer_, filling.data(), n) > 0) has_room = true;
    }
    return has_room;
  }

  Kind kind_;
  TemporaryFolder folder_;
  std::string path_, read_;
  int reader_ = -1, writer_ = -1;
};

inline std::ostream& operator<<(std::ostream& out, BlockableOutput::Kind kind) {
  constexpr const char* kNames[] = {"StoppedTerminal", "FullTerminal", "FullPipe"};
  return out << kNames[static_cast<std::size_t>(kind)];
}

inline constexpr BlockableOutput::Kind kBlockableKinds[] = {
    BlockableOutput::Kind::stopped_terminal, BlockableOutput::Kind::full_terminal, BlockableOutput::Kind::full_pipe};

}  // namespace kphi::test
