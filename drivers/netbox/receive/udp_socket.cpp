#include "drivers/netbox/receive/udp_socket.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/error.hpp"

namespace kphi::netbox {
namespace {

constexpr double kMebibyte = 1 << 20;
// The kernel doubles what is asked for.
constexpr std::size_t kWanted = 2 * UdpSocket::kWantedBuffer;

}  // namespace

/// What recvmmsg fills.
struct UdpSocket::Slots {
  Slots() {
    for (std::size_t i = 0; i < kBatch; ++i) {
      vectors[i] = {bytes[i].data(), bytes[i].size()};
      headers[i].msg_hdr.msg_iov = &vectors[i];
      headers[i].msg_hdr.msg_iovlen = 1;
      headers[i].msg_hdr.msg_control = controls[i].data();
    }
    rearm(kBatch);
  }
  /// The kernel overwrites the lengths of what it fills.
  void rearm(std::size_t used) noexcept {
    for (std::size_t i = 0; i < used; ++i) headers[i].msg_hdr.msg_controllen = controls[i].size();
  }

  using Control = std::array<char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))>;
  std::array<std::array<std::uint8_t, kLongest>, kBatch> bytes;
  alignas(cmsghdr) std::array<Control, kBatch> controls;
  std::array<iovec, kBatch> vectors{};
  std::array<mmsghdr, kBatch> headers{};
};

UdpSocket::UdpSocket(const Host& host, std::uint16_t port, std::size_t buffer_bytes)
    : slots_(std::make_unique<Slots>()) {
  const std::string device = fmt::format("Net Box {}:{}", host.name, port);
  addrinfo wanted{}, *found = nullptr;
  wanted.ai_family = AF_INET;  // the box speaks IPv4 only
  wanted.ai_socktype = SOCK_DGRAM;
  const int unknown = getaddrinfo(host.name.c_str(), std::to_string(port).c_str(), &wanted, &found);
  if (unknown != 0)
    throw DeviceError(device, "look up the name", gai_strerror(unknown), "check the host in the bench file");
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> address(found, &freeaddrinfo);
  socket_ = Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in own{};
  own.sin_family = AF_INET;
  if (!host.from.empty() && (inet_pton(AF_INET, host.from.c_str(), &own.sin_addr) != 1 ||
                             bind(descriptor(), reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0))
    throw DeviceError(device, "speak from " + host.from, std::strerror(errno),
                      "bind in the bench file must be an address of this computer: `ip -4 address`");
  if (connect(descriptor(), address->ai_addr, address->ai_addrlen) != 0)
    throw DeviceError(device, "open a UDP socket", std::strerror(errno), "check this computer's network settings");
  ask_for_buffer(buffer_bytes);
  const int on = 1;
  setsockopt(descriptor(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  setsockopt(descriptor(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
}

UdpSocket::~UdpSocket() = default;

void UdpSocket::ask_for_buffer(std::size_t bytes) {
  const int wanted = static_cast<int>(bytes);
  if (setsockopt(descriptor(), SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof wanted) != 0)
    setsockopt(descriptor(), SOL_SOCKET, SO_RCVBUF, &wanted, sizeof wanted);
  int granted = 0;
  socklen_t length = sizeof granted;
  getsockopt(descriptor(), SOL_SOCKET, SO_RCVBUF, &granted, &length);
  receive_buffer_bytes_ = static_cast<std::size_t>(granted);
}

std::span<const UdpSocket::Datagram> UdpSocket::receive() noexcept {
  slots_->rearm(std::exchange(used_, 0));
  int count = 0;
  do {
    count = recvmmsg(descriptor(), slots_->headers.data(), kBatch, MSG_DONTWAIT, nullptr);
  } while (count < 0 && retry(errno));
  used_ = static_cast<std::size_t>(std::max(count, 0));
  for (std::size_t i = 0; i < used_; ++i) read_control(i);
  return {datagrams_.data(), used_};
}

bool UdpSocket::send(std::span<const std::uint8_t> bytes) noexcept {
  // A refusal reported here belongs to an earlier datagram, and this one has not left yet.
  for (int attempt = 0; attempt < 8; ++attempt) {
    if (::send(descriptor(), bytes.data(), bytes.size(), MSG_NOSIGNAL) >= 0) return true;
    if (!retry(errno)) return false;
  }
  return false;
}

bool UdpSocket::retry(int error) noexcept {
  if (error == EINTR) return true;
  if (error == ECONNREFUSED) {
    ++refusals_;
    return true;
  }
  if (error != EAGAIN) last_error_ = error;
  return false;
}

void UdpSocket::read_control(std::size_t slot) noexcept {
  mmsghdr& header = slots_->headers[slot];
  Datagram& datagram = datagrams_[slot];
  datagram.bytes = {slots_->bytes[slot].data(), header.msg_len};
  datagram.stamp = {};
  for (cmsghdr* message = CMSG_FIRSTHDR(&header.msg_hdr); message; message = CMSG_NXTHDR(&header.msg_hdr, message)) {
    if (message->cmsg_level != SOL_SOCKET) continue;
    if (message->cmsg_type == SCM_TIMESTAMPNS) {
      std::memcpy(&datagram.stamp, CMSG_DATA(message), sizeof datagram.stamp);
    } else if (message->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t reported = 0;
      std::memcpy(&reported, CMSG_DATA(message), sizeof reported);
      dropped_ += reported - dropped_reported_;
      dropped_reported_ = reported;
    }
  }
  datagram.dropped = dropped_;
}

std::size_t ReceiveBuffer::datagrams() const noexcept {
  // Measured on Linux 5 and 6 for 36 and 1440 bytes; in between the allocator's next size.
  return bytes / (payload_bytes <= 100 ? 832 : payload_bytes <= 600 ? 1344 : 2315);
}

double ReceiveBuffer::tolerated_ms() const noexcept {
  return static_cast<double>(datagrams()) * 1e-6 * static_cast<double>(period.count());
}

std::string ReceiveBuffer::note() const {
  return fmt::format("{:.1f} MiB, tolerates {:.0f} ms{}", static_cast<double>(bytes) / kMebibyte, tolerated_ms(),
                     bytes < kWanted ? fmt::format("; for longer set net.core.rmem_max to {}", kWanted / 2) : "");
}

std::optional<Finding> ReceiveBuffer::finding() const {
  if (bytes >= kWanted) return std::nullopt;
  return Finding{tolerated_ms() < 500 ? Severity::warning : Severity::note,
                 fmt::format("the kernel grants {:.2f} MiB of receive buffer instead of {:.0f}: records are lost if "
                             "kphi is blocked for more than {:.0f} ms",
                             static_cast<double>(bytes) / kMebibyte, kWanted / kMebibyte, tolerated_ms()),
                 fmt::format("as root: sysctl -w net.core.rmem_max={}", kWanted / 2)};
}

}  // namespace kphi::netbox
