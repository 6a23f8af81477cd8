#include "drivers/sim/supply/port.hpp"

#include <fmt/format.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <utility>

#include "base/number.hpp"
#include "base/uri.hpp"

namespace kphi::sim {
namespace {

constexpr int kLine = 0;

}  // namespace

SupplyUri parse_supply_uri(const std::string& text) {
  const Uri uri(text, "supply", "write modbus-rtu:/path or modbus-tcp:HOST:PORT for a simulated supply");
  SupplyUri found;
  for (const auto& [key, value] : uri.options()) {
    if (key == "model") found.model = value;
    if (key != "slave") continue;
    const auto slave = parse_integer<unsigned>(value);
    if (!slave || *slave > 255) uri.refuse(fmt::format("slave \"{}\" is not a Modbus address", value), "use 1 to 247");
    found.slave = static_cast<int>(*slave);
  }
  if (uri.scheme() == "modbus-rtu" && uri.location().starts_with('/')) {
    found.addresses.device = uri.location();
  } else if (uri.scheme() == "modbus-tcp") {
    const HostPort tcp = uri.host_and_port(502);
    found.addresses.host = tcp.host;
    found.addresses.port = tcp.port;
  } else {
    uri.refuse("not an address of a simulated supply");
  }
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
  while (pty_ && pty_->plugged()) {
    const std::size_t count = pty_->read(buffer);
    if (count == 0) break;
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
