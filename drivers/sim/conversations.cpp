#include "drivers/sim/conversations.hpp"

#include <sys/socket.h>

#include <array>
#include <cerrno>

namespace kphi::sim {
namespace {

constexpr std::size_t kQuestionMax = 8192;
constexpr std::chrono::seconds kPatience{3};

}  // namespace

Conversations::Conversations(Descriptor listener, Manners manners, std::function<std::string(std::string_view)> answer)
    : listener_(std::move(listener)), manners_(std::move(manners)), answer_(std::move(answer)) {}

void Conversations::append_polls(std::vector<pollfd>& polls) const {
  if (connections_.size() < manners_.at_once) polls.push_back({listener_.number(), POLLIN, 0});
  for (const auto& connection : connections_) {
    const short writing = connection.to_say.empty() ? 0 : POLLOUT;
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
  while (connections_.size() < manners_.at_once) {
    const int number = ::accept4(listener_.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (number < 0) return;
    connections_.push_back({Descriptor(number), {}, {}});
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
    for (auto end = connection.heard.find(manners_.terminator); end != std::string::npos && !connection.closing;
         end = connection.heard.find(manners_.terminator)) {
      connection.to_say += answer_(std::string_view(connection.heard).substr(0, end));
      connection.heard.erase(0, end + manners_.terminator.size());
      connection.closing = manners_.one_answer;
    }
  }
}

void Conversations::say(Connection& connection) {
  while (!connection.to_say.empty()) {
    const auto& text = connection.to_say;
    const ssize_t count = ::send(connection.socket.number(), text.data(), text.size(), MSG_NOSIGNAL);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count <= 0) connection.to_say.clear();
    if (count > 0) connection.to_say.erase(0, static_cast<std::size_t>(count));
  }
}

}  // namespace kphi::sim
