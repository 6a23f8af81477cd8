#include "drivers/sim/supply/port.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <stdexcept>
#include <utility>

namespace kphi::sim {
namespace {

constexpr int kLine = 0;
constexpr int kQuietSteps = 2000;  // without a client's word, its exclusive opening may have outlived it

int number_in(const std::string& text, const std::string& uri) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size() && value >= 0 && value <= 65535) return value;
  throw std::invalid_argument("supply.uri " + uri + ": \"" + text + "\" is not a number from 0 to 65535");
}

void read_query(std::string query, SupplyUri& found, const std::string& uri) {
  while (!query.empty()) {
    const std::size_t end = std::min(query.find('&'), query.size());
    const std::string part = query.substr(0, end);
    query.erase(0, end + 1);
    if (part.starts_with("model=")) found.model = part.substr(6);
    if (part.starts_with("slave=")) found.slave = number_in(part.substr(6), uri);
  }
}

}  // namespace

SupplyUri parse_supply_uri(const std::string& uri) {
  SupplyUri found;
  const std::size_t question = std::min(uri.find('?'), uri.size());
  const std::size_t colon = uri.find(':');
  const std::string scheme = uri.substr(0, colon);
  const std::string where = colon < question ? uri.substr(colon + 1, question - colon - 1) : "";
  if (question < uri.size()) read_query(uri.substr(question + 1), found, uri);
  if (scheme == "modbus-rtu" && where.starts_with('/')) {
    found.addresses.device = where;
    return found;
  }
  if (scheme != "modbus-tcp" || where.empty())
    throw std::invalid_argument("supply.uri " + uri +
                                ": a simulated supply is at modbus-rtu:/path or modbus-tcp:host:port");
  const std::size_t last = where.rfind(':');
  found.addresses.host = where.substr(0, last);
  found.addresses.port =
      static_cast<std::uint16_t>(last == std::string::npos ? 502 : number_in(where.substr(last + 1), uri));
  return found;
}

SupplyPort::SupplyPort(SupplyAddresses addresses) : addresses_(std::move(addresses)) {
  open();
  if (pty_) device_ = pty_->path();
  if (listening_) addresses_.port = listening_->port;
}

void SupplyPort::open() {
  if (pty_) {
    pty_->plug();
  } else if (addresses_.device) {
    pty_.emplace(*addresses_.device);
  }
  if (addresses_.host) listening_ = listen_at(*addresses_.host, SOCK_STREAM, addresses_.port);
  open_ = true;
}

void SupplyPort::append_polls(std::vector<pollfd>& all) const {
  if (pty_) all.push_back({pty_->number(), POLLIN, 0});
  if (listening_) all.push_back({listening_->socket.number(), POLLIN, 0});
  for (const auto& [number, socket] : clients_) all.push_back({socket.number(), POLLIN, 0});
}

void SupplyPort::receive(SupplySlave& slave, Instant now) {
  open_or_close(slave, now);
  hear_line(slave, now);
  welcome();
  hear_clients(slave, now);
}

void SupplyPort::open_or_close(SupplySlave& slave, Instant now) {
  const bool closed = slave.closed(now);
  if (closed && open_) {
    open_ = false;
    slave.forget(kLine);
    for (const auto& [number, socket] : clients_) slave.forget(number);
    if (pty_) pty_->unplug();
    listening_.reset();
    clients_.clear();
  } else if (!closed && !open_) {
    open();
  }
}

void SupplyPort::hear_line(SupplySlave& slave, Instant now) {
  std::array<std::uint8_t, 512> buffer{};
  if (++quiet_steps_ == kQuietSteps && pty_) pty_->unlock();
  while (pty_ && pty_->plugged()) {
    const std::size_t count = pty_->read(buffer);
    if (count == 0) break;
    quiet_steps_ = 0;
    slave.receive(kLine, ModbusFraming::rtu, std::span(buffer).first(count), now);
  }
}

void SupplyPort::welcome() {
  while (listening_) {
    Descriptor client(::accept4(listening_->socket.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (client.number() < 0) return;
    clients_.emplace(++last_client_, std::move(client));
  }
}

void SupplyPort::hear_clients(SupplySlave& slave, Instant now) {
  std::array<std::uint8_t, 512> buffer{};
  std::erase_if(clients_, [&](const auto& client) {
    const auto& [number, socket] = client;
    const ssize_t count = ::recv(socket.number(), buffer.data(), buffer.size(), 0);
    if (count > 0)
      slave.receive(number, ModbusFraming::tcp, std::span(buffer).first(static_cast<std::size_t>(count)), now);
    const bool gone = count == 0 || (count < 0 && errno != EAGAIN) || !slave.makes_sense(number);
    if (gone) slave.forget(number);
    return gone;
  });
}

void SupplyPort::send(SupplySlave& slave, Instant now) {
  SupplyReply reply;
  while (slave.next_reply(reply, now)) {
    if (reply.client == kLine) {
      if (pty_) (void)pty_->write(reply.bytes);
    } else if (const auto client = clients_.find(reply.client); client != clients_.end()) {
      [[maybe_unused]] const auto sent =
          ::send(client->second.number(), reply.bytes.data(), reply.bytes.size(), MSG_NOSIGNAL);
    }
  }
}

}  // namespace kphi::sim
