#include "base/tcp.hpp"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

namespace kphi {
namespace {

using Clock = std::chrono::steady_clock;
using Addresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

[[noreturn]] void fail(int error) {
  throw TcpError(error == ECONNREFUSED ? TcpError::Cause::refused : TcpError::Cause::other, std::strerror(error));
}

Addresses look_up(const std::string& host, std::uint16_t port) {
  addrinfo wanted{}, *found = nullptr;
  wanted.ai_socktype = SOCK_STREAM;
  const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found);
  if (error != 0) throw TcpError(TcpError::Cause::unknown_name, gai_strerror(error));
  return {found, &freeaddrinfo};
}

bool again(int error) noexcept { return error == EAGAIN || error == EINTR; }

}  // namespace

TcpClient::TcpClient(std::chrono::nanoseconds wall_timeout) noexcept : deadline_(Clock::now() + wall_timeout) {}

void TcpClient::connect(const std::string& host, std::uint16_t port) {
  const Addresses addresses = look_up(host, port);
  step_ = "connect";
  int error = 0;
  for (const addrinfo* at = addresses.get(); at != nullptr; at = at->ai_next) {
    socket_ = Descriptor(::socket(at->ai_family, at->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, at->ai_protocol));
    if (::connect(socket_.number(), at->ai_addr, at->ai_addrlen) == 0) return;
    error = errno;
    if (error == EINPROGRESS) {
      wait_for(POLLOUT);
      socklen_t size = sizeof error;
      getsockopt(socket_.number(), SOL_SOCKET, SO_ERROR, &error, &size);
      if (error == 0) return;
    }
  }
  fail(error);
}

void TcpClient::send(std::string_view bytes) {
  step_ = "send the request";
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    } else if (again(errno)) {
      wait_for(POLLOUT);
    } else {
      fail(errno);
    }
  }
}

bool TcpClient::receive(std::string& to) {
  step_ = "read the answer";
  std::array<char, 4096> bytes;
  for (;;) {
    wait_for(POLLIN);
    const ssize_t received = ::recv(socket_.number(), bytes.data(), bytes.size(), 0);
    if (received >= 0) {
      to.append(bytes.data(), static_cast<std::size_t>(received));
      return received > 0;
    }
    if (!again(errno)) fail(errno);
  }
}

void TcpClient::wait_for(short events) const {
  pollfd socket{socket_.number(), events, 0};
  for (;;) {
    const auto left = deadline_ - Clock::now();
    if (left <= Clock::duration::zero()) throw TcpError(TcpError::Cause::timeout, "no answer in time");
    const auto ms = std::min(std::chrono::ceil<std::chrono::milliseconds>(left).count(), std::int64_t{60'000});
    if (::poll(&socket, 1, static_cast<int>(ms)) > 0) return;
  }
}

}  // namespace kphi
