#include "drivers/sim/transport/conversations.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "base/error.hpp"

namespace kphi::sim {
namespace {

constexpr std::size_t kQuestionMax = 8192;
constexpr std::chrono::seconds kPatience{3};

[[noreturn]] void refuse(const std::string& where, const std::string& operation, const std::string& cause,
                         const std::string& next_move) {
  throw DeviceError("simulated bench " + where, operation, cause, next_move);
}

sockaddr_in address_of(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), nullptr, &hints, &found); error != 0) {
    refuse(host, "resolve", ::gai_strerror(error), "name an address of this machine in netbox.host");
  }
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof address);
  ::freeaddrinfo(found);
  address.sin_port = htons(port);
  return address;
}

}  // namespace

Listening listen_at(const std::string& host, int type, std::uint16_t port) {
  sockaddr_in address = address_of(host, port);
  Descriptor socket(::socket(AF_INET, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int yes = 1;
  if (type == SOCK_STREAM) ::setsockopt(socket.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const int buffer = 4 << 20;
  if (type == SOCK_DGRAM) ::setsockopt(socket.number(), SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
  socklen_t size = sizeof address;
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  const bool open = ::bind(socket.number(), generic, size) == 0 &&
                    (type == SOCK_DGRAM || ::listen(socket.number(), 16) == 0) &&
                    ::getsockname(socket.number(), generic, &size) == 0;
  if (!open) {
    refuse(host + ":" + std::to_string(port), "listen", std::strerror(errno),
           "is another simulator running? Else choose other ports in the bench file");
  }
  return {std::move(socket), ntohs(address.sin_port)};
}

std::optional<sockaddr_un> unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return std::nullopt;
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

Conversations::Conversations(Descriptor listener, const Manners& manners,
                             std::function<StreamReply(std::string_view)> answer)
    : Conversations(std::move(listener), manners.at_once, [manners, answer = std::move(answer)](std::string& heard) {
        StreamReply all;
        for (auto end = heard.find(manners.terminator); end != std::string::npos && !all.close;
             end = heard.find(manners.terminator)) {
          StreamReply one = answer(std::string_view(heard).substr(0, end));
          heard.erase(0, end + manners.terminator.size());
          all.bytes += one.bytes;
          all.wait = one.wait;
          all.close = one.close || manners.one_answer;
        }
        return all;
      }) {}

Conversations::Conversations(Descriptor listener, std::size_t at_once, Answerer answerer)
    : listener_(std::move(listener)), at_once_(at_once), answerer_(std::move(answerer)) {}

void Conversations::listen_at(Descriptor listener) {
  listener_ = std::move(listener);
  if (!listening()) connections_.clear();
}

void Conversations::append_polls(std::vector<pollfd>& polls) const {
  if (listening() && connections_.size() < at_once_) polls.push_back({listener_.number(), POLLIN, 0});
  for (const auto& connection : connections_) {
    const bool waiting = connection.speak_at > std::chrono::steady_clock::now();
    const short writing = connection.to_say.empty() || waiting ? 0 : POLLOUT;
    polls.push_back({connection.socket.number(), static_cast<short>(POLLIN | writing), 0});
  }
}

void Conversations::serve() {
  welcome();
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
