#include "drivers/sim/listening.hpp"

#include <netdb.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "drivers/device_error.hpp"

namespace kphi::sim {
namespace {

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

}  // namespace kphi::sim
