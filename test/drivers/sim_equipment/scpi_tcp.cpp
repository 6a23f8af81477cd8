#include "test/drivers/sim_equipment/scpi_tcp.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <vector>

namespace kphi::sim {
namespace {

constexpr std::size_t kLongestLine = 65536;

}  // namespace

ScpiTcp::ScpiTcp(ScpiInstrument& instrument, UsbFaults& faults, std::uint16_t port)
    : instrument_(instrument),
      faults_(faults),
      listening_(listen_at("127.0.0.1", SOCK_STREAM, port)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      thread_([this] { run(); }) {}

ScpiTcp::~ScpiTcp() {
  ::eventfd_write(wake_.number(), 1);
  thread_.join();
}

void ScpiTcp::run() noexcept {
  for (;;) {
    std::vector<pollfd> waited{{wake_.number(), POLLIN, 0}, {listening_.socket.number(), POLLIN, 0}};
    for (const Client& client : clients_) waited.push_back({client.socket.number(), POLLIN, 0});
    ::poll(waited.data(), waited.size(), patience_ms());
    if (waited[0].revents != 0) return;
    std::size_t i = 2;
    for (auto client = clients_.begin(); client != clients_.end(); ++i) {
      const bool stays = waited[i].revents == 0 || hear(*client);
      answer(*client);
      client = stays ? std::next(client) : clients_.erase(client);
    }
    if (waited[1].revents != 0) accept();
  }
}

void ScpiTcp::accept() {
  const int socket = ::accept4(listening_.socket.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (socket >= 0) clients_.push_back({Descriptor(socket), {}, {}});
}

/// False: the connection has ended.
bool ScpiTcp::hear(Client& client) {
  std::array<char, 4096> buffer;
  const ssize_t count = ::recv(client.socket.number(), buffer.data(), buffer.size(), 0);
  if (count < 0) return errno == EAGAIN || errno == EINTR;
  if (count == 0) return false;
  client.received.append(buffer.data(), static_cast<std::size_t>(count));
  for (std::size_t end; (end = client.received.find('\n')) != std::string::npos;) {
    const std::string line = client.received.substr(0, end);
    client.received.erase(0, end + 1);
    if (!apply(client, line)) return false;
  }
  return client.received.size() <= kLongestLine;
}

bool ScpiTcp::apply(Client& client, const std::string& line) {
  const std::string said = instrument_.apply(line);
  if (said.empty()) return true;
  if (faults_.strikes(FaultKind::usb_closed)) return false;
  if (faults_.strikes(FaultKind::ambient_no_reply)) return true;
  const auto late = faults_.strikes(FaultKind::ambient_late);
  client.answers.emplace_back(faults_.now() + (late ? late->delay : Duration{0}), said + "\n");
  return true;
}

void ScpiTcp::answer(Client& client) {
  while (!client.answers.empty() && client.answers.front().first <= faults_.now()) {
    const std::string& text = client.answers.front().second;
    (void)!::send(client.socket.number(), text.data(), text.size(), MSG_NOSIGNAL);
    client.answers.pop_front();
  }
}

int ScpiTcp::patience_ms() const {
  Instant next = kNever;
  for (const Client& client : clients_)
    if (!client.answers.empty()) next = std::min(next, client.answers.front().first);
  if (next == kNever) return -1;
  const Duration wall = faults_.clock().shrunk(std::max(Duration{0}, next - faults_.now()));
  return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(wall).count());
}

}  // namespace kphi::sim
