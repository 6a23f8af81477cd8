// A TCP connection with one time limit for all of it: name, connection, sending, receiving.
#pragma once

#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "base/descriptor.hpp"

namespace kphi {

class TcpError : public std::runtime_error {
 public:
  enum class Cause : std::uint8_t { unknown_name, refused, timeout, other };
  TcpError(Cause why, const std::string& words) : std::runtime_error(words), cause(why) {}
  Cause cause;
};

class TcpClient {
 public:
  /// `wall_timeout` runs from here to the last receive(). The step under way: "look up the name", "connect", "send the
  /// request", "read the answer".
  explicit TcpClient(std::chrono::nanoseconds wall_timeout) noexcept;
  /// Throws TcpError, as the others do.
  void connect(const std::string& host, std::uint16_t port);
  void send(std::string_view bytes);
  /// Appends the bytes received next, at least one; false when the peer has closed the connection.
  [[nodiscard]] bool receive(std::string& to);
  [[nodiscard]] const char* step() const noexcept { return step_; }

 private:
  void wait_for(short events) const;

  const std::chrono::steady_clock::time_point deadline_;
  const char* step_ = "look up the name";
  Descriptor socket_;
};

}  // namespace kphi
