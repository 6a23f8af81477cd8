// Sockets of the simulated bench, and text questions and answers over them without ever blocking: the box's web server
// and the control line.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <string>
#include <string_view>
#include <utility>

#include "base/clock.hpp"
#include "base/descriptor.hpp"

namespace kphi::sim {

struct Listening {
  Descriptor socket;
  std::uint16_t port = 0;
};

/// Non-blocking; `type`: SOCK_DGRAM (with a large send buffer) or SOCK_STREAM; port 0: any free one. `host`: IPv4 name
/// or address. Throws DeviceError.
[[nodiscard]] Listening listen_at(const std::string& host, int type, std::uint16_t port);

/// What to send over a stream socket.
struct StreamReply {
  std::string bytes;
  Duration wait{0};         ///< before the first byte
  std::size_t segment = 0;  ///< at most this many bytes at once; 0: all
  Duration pause{0};        ///< between two segments
  bool close = false;       ///< after the last byte
};

/// Of questions that end with `terminator`; `answer` gets them without it.
[[nodiscard]] std::function<StreamReply(std::string& heard)> each_question(
    std::string terminator, std::function<StreamReply(std::string_view)> answer);

/// Its times are wall time.
class Conversations {
 public:
  /// Takes whole questions off the front of `heard` and returns what to send.
  using Answerer = std::function<StreamReply(std::string& heard)>;
  /// `listener`: non-blocking and listening. `at_once`: connections served at the same time; others wait in the queue.
  Conversations(Descriptor listener, std::size_t at_once, Answerer answerer)
      : listener_(std::move(listener)), at_once_(at_once), answerer_(std::move(answerer)) {}

  /// Replaces the listener; an empty one refuses connections and ends the open ones.
  void listen_at(Descriptor listener);
  [[nodiscard]] bool listening() const noexcept { return listener_.number() >= 0; }
  /// To wait at for who calls; -1: nobody can.
  [[nodiscard]] int listener() const noexcept { return listener_.number(); }
  /// Does what can be done now; also drops clients that were silent for 3 s of wall time. `called`: somebody may wait
  /// to be welcomed.
  void serve(bool called = true);

 private:
  struct Connection {
    Descriptor socket;
    std::string heard;
    std::string to_say;
    bool closing = false;
    std::size_t segment = 0;
    Duration pause{0};
    std::chrono::steady_clock::time_point speak_at{};
    std::chrono::steady_clock::time_point heard_at = std::chrono::steady_clock::now();
  };
  void welcome();
  void hear(Connection& connection);
  void say(Connection& connection);

  Descriptor listener_;
  std::size_t at_once_;
  Answerer answerer_;
  std::list<Connection> connections_;
};

}  // namespace kphi::sim
