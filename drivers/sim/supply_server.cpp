#include "drivers/sim/supply_server.hpp"

#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <utility>

namespace kphi::sim {
namespace {

constexpr int kLine = 0;
constexpr int kQuietSteps = 2000;  // without a client's word, its exclusive opening may have outlived it
constexpr Duration kTick = std::chrono::milliseconds(1);  // of the physics, and longest nap

}  // namespace

SupplyServer::SupplyServer(const SupplyServerSettings& settings)
    : settings_(settings), stop_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)), slave_(settings.supply) {
  pty_.emplace(settings_.device);
  listening_ = listen_at(settings_.host, SOCK_STREAM, settings_.port);
  device_ = pty_->path();
  port_ = settings_.port = listening_->port;
}

void SupplyServer::request_stop() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(stop_.number(), &one, sizeof one);
}

void SupplyServer::inspect(const std::function<void(SupplySlave&, SupplyLoad&, Instant)>& look) {
  const std::lock_guard lock(mutex_);
  look(slave_, settings_.load, clock_.now());
}

void SupplyServer::run() {
  while (true) {
    std::vector<pollfd> all = polls();
    ::poll(all.data(), all.size(), patience());
    if ((all.front().revents & POLLIN) != 0) return;
    const std::lock_guard lock(mutex_);
    step();
  }
}

std::vector<pollfd> SupplyServer::polls() const {
  std::vector<pollfd> all{{stop_.number(), POLLIN, 0}};
  if (pty_) all.push_back({pty_->number(), POLLIN, 0});
  if (listening_) all.push_back({listening_->socket.number(), POLLIN, 0});
  for (const auto& [number, socket] : clients_) all.push_back({socket.number(), POLLIN, 0});
  return all;
}

/// In ms: at least one tick of the physics per ms; 0 when a reply is due.
int SupplyServer::patience() {
  const std::lock_guard lock(mutex_);
  return slave_.next_due() <= clock_.now() + kTick / 2 ? 0 : 1;
}

void SupplyServer::step() {
  const Instant now = clock_.now();
  open_or_close(now);
  slave_.advance(settings_.load, now);
  hear_line(now);
  welcome();
  hear_clients(now);
  send(clock_.now());
}

void SupplyServer::open_or_close(Instant now) {
  const bool closed = slave_.closed(now);
  if (closed && pty_) {
    slave_.forget(kLine);
    for (const auto& [number, socket] : clients_) slave_.forget(number);
    pty_.reset();
    listening_.reset();
    clients_.clear();
  } else if (!closed && !pty_) {
    pty_.emplace(settings_.device);
    listening_ = listen_at(settings_.host, SOCK_STREAM, settings_.port);
  }
}

void SupplyServer::hear_line(Instant now) {
  std::array<std::uint8_t, 512> buffer{};
  if (++quiet_steps_ == kQuietSteps && pty_) pty_->unlock();
  while (pty_) {
    const std::size_t count = pty_->read(buffer);
    if (count == 0) break;
    quiet_steps_ = 0;
    slave_.receive(kLine, ModbusFraming::rtu, std::span(buffer).first(count), now);
  }
}

void SupplyServer::welcome() {
  while (listening_) {
    Descriptor client(::accept4(listening_->socket.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (client.number() < 0) return;
    clients_.emplace(++last_client_, std::move(client));
  }
}

void SupplyServer::hear_clients(Instant now) {
  std::array<std::uint8_t, 512> buffer{};
  std::erase_if(clients_, [&](const auto& client) {
    const auto& [number, socket] = client;
    const ssize_t count = ::recv(socket.number(), buffer.data(), buffer.size(), 0);
    if (count > 0)
      slave_.receive(number, ModbusFraming::tcp, std::span(buffer).first(static_cast<std::size_t>(count)), now);
    const bool gone = count == 0 || (count < 0 && errno != EAGAIN) || !slave_.makes_sense(number);
    if (gone) slave_.forget(number);
    return gone;
  });
}

void SupplyServer::send(Instant now) {
  SupplyReply reply;
  while (slave_.next_reply(reply, now)) {
    if (reply.client == kLine) {
      if (pty_) (void)pty_->write(reply.bytes);
    } else if (const auto client = clients_.find(reply.client); client != clients_.end()) {
      [[maybe_unused]] const auto sent =
          ::send(client->second.number(), reply.bytes.data(), reply.bytes.size(), MSG_NOSIGNAL);
    }
  }
}

}  // namespace kphi::sim
