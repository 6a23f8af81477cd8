// A TCP connection with one time limit for all of it: connection, sending, receiving; or one for each step.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace kphi {

/// A name or address, and the address of this computer to speak from where several network cards could; empty: as the
/// kernel routes.
struct Host {
  Host(const char* host) : name(host) {}  // most are only a name
  Host(std::string host, std::string own = {}) : name(std::move(host)), from(std::move(own)) {}
  std::string name, from;
};

class TcpError : public std::runtime_error {
 public:
  enum class Cause : std::uint8_t { unknown_name, no_such_address, refused, timeout, reset, other };
  TcpError(Cause why, const std::string& words) : std::runtime_error(words), cause(why) {}
  Cause cause;
};

class TcpClient {
 public:
  /// `wall_timeout` runs from here to the last receive(). The step under way: "look up the name", "connect", "send the
  /// request", "read the answer".
  explicit TcpClient(std::chrono::nanoseconds wall_timeout) { allow(wall_timeout); }
  /// A new limit from here on.
  void allow(std::chrono::nanoseconds wall_timeout) { stream_.expires_after(wall_timeout); }
  /// Throws TcpError, as the others do.
  void connect(const Host& host, std::uint16_t port);
  void send(std::string_view bytes);
  /// Appends the bytes received next, at least one; false when the peer has closed the connection.
  [[nodiscard]] bool receive(std::string& to);
  [[nodiscard]] const char* step() const noexcept { return step_; }

 private:
  /// Runs an operation to its end; returns the number of bytes, 0 if the peer has closed the connection.
  template <class Start>
  std::size_t carry_out(const char* step, Start&& start);

  boost::asio::io_context io_{1};
  boost::beast::tcp_stream stream_{io_};
  const char* step_ = "look up the name";
};

}  // namespace kphi
