// A fake box in a process of its own, so that its work is not counted as the reader's. To be made before any thread.
#pragma once

#include <sys/wait.h>

#include <array>
#include <bit>

#include "test/drivers/netbox/fake_box.hpp"

namespace kphi::netbox::test {

/// Bytes of plain structs between a process and its child.
class Pipe {
 public:
  Pipe() {
    if (pipe(ends_) != 0) throw std::runtime_error("no pipe");
  }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  template <class T>
  bool put(const T& value) const {
    return write(ends_[1], &value, sizeof value) == sizeof value;
  }
  template <class T>
  bool get(T& value) const {
    pollfd readable{ends_[0], POLLIN, 0};
    std::array<char, sizeof(T)> bytes;
    if (poll(&readable, 1, 20'000) != 1 || read(ends_[0], bytes.data(), bytes.size()) != sizeof value) return false;
    value = std::bit_cast<T>(bytes);
    return true;
  }
  void close_reading() { close_end(0); }
  void close_writing() { close_end(1); }
  void wait_for_end() const {
    char byte;
    while (read(ends_[0], &byte, 1) > 0) {
    }
  }

 private:
  void close_end(int end) {
    if (ends_[end] >= 0) close(ends_[end]);
    ends_[end] = -1;
  }
  int ends_[2]{-1, -1};
};

struct Ports {
  std::uint16_t rdt = 0, http = 0;
};

class BoxProcess {
 public:
  explicit BoxProcess(const FakeBox::Manner& manner) : child_(fork()) {
    if (child_ < 0) throw std::runtime_error("no process");
    if (child_ == 0) {
      life_.close_writing();
      {
        FakeWeb web(FakeWeb::page(streaming_xml(manner.records_per_datagram, manner.divisor)));
        FakeBox box(manner);
        ports_pipe_.put(Ports{box.port(), web.port()});
        life_.wait_for_end();
      }
      _exit(0);
    }
    life_.close_reading();
    if (!ports_pipe_.get(ports_)) throw std::runtime_error("the box's process does not answer");
  }
  ~BoxProcess() {
    life_.close_writing();
    waitpid(child_, nullptr, 0);
  }
  BoxProcess(const BoxProcess&) = delete;
  BoxProcess& operator=(const BoxProcess&) = delete;
  const Ports& ports() const { return ports_; }

 private:
  Pipe life_, ports_pipe_;  // the parent's end of `life_` closes with the parent, whatever happens to it
  pid_t child_;
  Ports ports_;
};

}  // namespace kphi::netbox::test
