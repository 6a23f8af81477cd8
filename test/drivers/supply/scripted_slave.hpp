// A slave that expects given bytes and answers given bytes, on a pseudo-terminal.
#pragma once

#include <poll.h>
#include <unistd.h>

#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "test/drivers/serial/pseudo_terminal.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::supply::test {

/// Request and reply as the manuals print them.
using Exchange = std::pair<std::string, std::string>;

class ScriptedSlave {
 public:
  explicit ScriptedSlave(std::vector<Exchange> script) : script_(std::move(script)), thread_([this] { play(); }) {}
  ~ScriptedSlave() { thread_.join(); }

  [[nodiscard]] const std::string& device() const { return line_.name(); }
  /// What came instead of what was expected; empty. To be read when all has been asked.
  [[nodiscard]] std::string surprise() {
    if (thread_.joinable()) thread_.join();
    thread_ = std::thread([] {});
    return surprise_;
  }

 private:
  void play() {
    for (const auto& [request, reply] : script_) {
      const std::size_t expected = sim::test::bytes(request).size();
      std::vector<std::uint8_t> heard;
      pollfd line{line_.master(), POLLIN, 0};
      while (heard.size() < expected && ::poll(&line, 1, 5000) > 0) {
        std::uint8_t buffer[256];
        const ssize_t count = ::read(line_.master(), buffer, sizeof buffer);
        if (count <= 0) break;
        heard.insert(heard.end(), buffer, buffer + count);
      }
      if (sim::test::hex(heard) != sim::test::hex(request)) {
        surprise_ = "expected " + sim::test::hex(request) + ", heard " + sim::test::hex(heard);
        return;
      }
      const auto answer = sim::test::bytes(reply);
      if (::write(line_.master(), answer.data(), answer.size()) < 0) return;
    }
  }

  serial::fake::PseudoTerminal line_;
  std::vector<Exchange> script_;
  std::string surprise_;
  std::thread thread_;
};

}  // namespace kphi::supply::test
