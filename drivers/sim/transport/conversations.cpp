#include "drivers/sim/transport/conversations.hpp"

#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cerrno>

#include "base/error.hpp"

namespace kphi::sim {
namespace {

constexpr std::size_t kQuestionMax = 8192;
constexpr std::chrono::seconds kPatience{3};

/// Takes the descriptor of an open socket or acceptor.
Listening taken_over(auto socket) {
  socket.native_non_blocking(true);
  const std::uint16_t port = socket.local_endpoint().port();
  return {Descriptor(socket.release()), port};
}

}  // namespace

Listening listen_at(const std::string& host, int type, std::uint16_t port) {
  using boost::asio::ip::tcp, boost::asio::ip::udp;
  const std::string where = "simulated bench " + host;
  boost::asio::io_context io;
  boost::system::error_code unknown;
  const auto found = tcp::resolver(io).resolve(tcp::v4(), host, std::to_string(port), unknown);
  if (unknown)
    throw DeviceError(where, "resolve", unknown.message(), "name an address of this computer in netbox.host");
  const tcp::endpoint at = *found.begin();
  try {
    if (type == SOCK_STREAM) return taken_over(tcp::acceptor(io, at));
    udp::socket socket(io, udp::endpoint(at.address(), at.port()));
    socket.set_option(udp::socket::send_buffer_size(4 << 20));
    return taken_over(std::move(socket));
  } catch (const boost::system::system_error& error) {
    throw DeviceError(fmt::format("{}:{}", where, port), "listen", error.code().message(),
                      "stop any other simulator, or choose other ports in the bench file");
  }
}

std::function<StreamReply(std::string& heard)> each_question(std::string terminator,
                                                             std::function<StreamReply(std::string_view)> answer) {
  return [terminator = std::move(terminator), answer = std::move(answer)](std::string& heard) {
    StreamReply all;
    for (std::size_t end = 0; !all.close && (end = heard.find(terminator)) != std::string::npos;) {
      StreamReply one = answer(std::string_view(heard).substr(0, end));
      heard.erase(0, end + terminator.size());
      all.bytes += one.bytes;
      all.wait = one.wait;
      all.close = one.close;
    }
    return all;
  };
}

void Conversations::listen_at(Descriptor listener) {
  listener_ = std::move(listener);
  if (!listening()) connections_.clear();
}

void Conversations::serve(bool called) {
  if (called) welcome();
  if (connections_.empty()) return;
  const auto now = std::chrono::steady_clock::now();
  for (auto& connection : connections_) {
    hear(connection);
    say(connection);
    if (now - connection.heard_at > kPatience) connection.closing = true;
  }
  connections_.remove_if([](const Connection& c) { return c.closing && c.to_say.empty(); });
}

void Conversations::welcome() {
  while (listening() && connections_.size() < at_once_) {
    const int number = ::accept4(listener_.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (number < 0) return;
    connections_.emplace_back();
    connections_.back().socket = Descriptor(number);
    // Segments leave as they are written. Not known to sockets of other families, which need it not.
    const int yes = 1;
    ::setsockopt(number, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  }
}

void Conversations::hear(Connection& connection) {
  std::array<char, 1024> bytes{};
  while (!connection.closing) {
    const ssize_t count = ::recv(connection.socket.number(), bytes.data(), bytes.size(), 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count <= 0 || connection.heard.size() > kQuestionMax) {
      connection.closing = true;
      return;
    }
    connection.heard_at = std::chrono::steady_clock::now();
    connection.heard.append(bytes.data(), static_cast<std::size_t>(count));
    const StreamReply answer = answerer_(connection.heard);
    connection.to_say += answer.bytes;
    if (!answer.bytes.empty()) {
      connection.segment = answer.segment;
      connection.pause = answer.pause;
    }
    if (answer.wait.count() > 0) connection.speak_at = connection.heard_at + answer.wait;
    connection.closing = answer.close;
  }
}

void Conversations::say(Connection& connection) {
  auto& text = connection.to_say;
  while (!text.empty() && connection.speak_at <= std::chrono::steady_clock::now()) {
    const std::size_t size = connection.segment == 0 ? text.size() : std::min(connection.segment, text.size());
    const ssize_t count = ::send(connection.socket.number(), text.data(), size, MSG_NOSIGNAL);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    text.erase(0, count > 0 ? static_cast<std::size_t>(count) : text.size());
    if (connection.segment != 0) connection.speak_at = std::chrono::steady_clock::now() + connection.pause;
  }
}

}  // namespace kphi::sim
