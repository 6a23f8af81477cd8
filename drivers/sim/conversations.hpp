// Text questions and answers over stream sockets, without ever blocking: the box's web server and the control line.
#pragma once

#include <poll.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <list>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim/descriptor.hpp"

namespace kphi::sim {

class Conversations {
 public:
  struct Manners {
    std::string terminator;   ///< ends a question
    bool one_answer = false;  ///< close after the first
    std::size_t at_once = 1;  ///< connections served at the same time; others wait in the queue
  };
  /// `listener`: non-blocking and listening. `answer`: question without its terminator -> bytes to send.
  Conversations(Descriptor listener, Manners manners, std::function<std::string(std::string_view)> answer);

  void append_polls(std::vector<pollfd>& polls) const;
  /// Does what can be done now; also drops who has been silent for 3 s of wall time.
  void serve();

 private:
  struct Connection {
    Descriptor socket;
    std::string heard;
    std::string to_say;
    bool closing = false;
    std::chrono::steady_clock::time_point heard_at = std::chrono::steady_clock::now();
  };
  void welcome();
  void hear(Connection& connection);
  void say(Connection& connection);

  Descriptor listener_;
  Manners manners_;
  std::function<std::string(std::string_view)> answer_;
  std::list<Connection> connections_;
};

}  // namespace kphi::sim
