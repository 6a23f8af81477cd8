// A UDP socket for the datagrams of one peer, with the kernel's receive stamps and its count of drops. One thread.
#pragma once

#include <time.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/descriptor.hpp"
#include "base/finding.hpp"
#include "base/tcp.hpp"

namespace kphi::netbox {

class UdpSocket {
 public:
  static constexpr std::size_t kBatch = 64;
  struct Datagram {
    std::span<const std::uint8_t> bytes;  ///< valid until the next receive()
    timespec stamp{};                     ///< CLOCK_REALTIME; zero when the kernel gave none
    std::uint64_t dropped = 0;            ///< by a full receive buffer, since the socket was opened
  };

  static constexpr std::size_t kWantedBuffer = std::size_t{4} << 20;

  /// Connects, so that only this peer's datagrams come in. Asks for `buffer_bytes` of receive buffer, and takes what
  /// the kernel grants. Throws DeviceError.
  UdpSocket(const Host& host, std::uint16_t port, std::size_t buffer_bytes = kWantedBuffer);
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  /// The waiting datagrams, at most kBatch; never blocks, allocates nothing.
  [[nodiscard]] std::span<const Datagram> receive() noexcept;
  /// False if the kernel refused it.
  bool send(std::span<const std::uint8_t> bytes) noexcept;
  [[nodiscard]] int descriptor() const noexcept { return socket_.number(); }
  /// The kernel's receive buffer, as read back.
  [[nodiscard]] std::size_t receive_buffer_bytes() const noexcept { return receive_buffer_bytes_; }
  /// Times the peer's host answered that nobody listens at the port.
  [[nodiscard]] std::uint64_t refusals() const noexcept { return refusals_; }
  /// errno of the last failure that is neither a refusal nor an interruption; 0 = none.
  [[nodiscard]] int last_error() const noexcept { return last_error_; }

 private:
  static constexpr std::size_t kLongest = 1500;  // not a multiple of 36: a truncated datagram is refused by its size
  struct Slots;

  void ask_for_buffer(std::size_t bytes);
  void read_control(std::size_t slot) noexcept;
  bool retry(int error) noexcept;

  Descriptor socket_;
  std::size_t receive_buffer_bytes_ = 0;
  std::uint64_t refusals_ = 0;
  int last_error_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint32_t dropped_reported_ = 0;
  std::unique_ptr<Slots> slots_;
  std::size_t used_ = 0;  // of the slots, by the last receive()
  std::array<Datagram, kBatch> datagrams_{};
};

/// The kernel's receive buffer, and how long this process may be blocked before datagrams are dropped.
struct ReceiveBuffer {
  std::size_t bytes = 0;            ///< as the kernel reports it: twice what was asked for
  std::size_t payload_bytes = 0;    ///< of one datagram
  std::chrono::nanoseconds period;  ///< between two datagrams, wall time

  /// Datagrams that fit: the kernel charges each with its bookkeeping.
  [[nodiscard]] std::size_t datagrams() const noexcept;
  [[nodiscard]] double tolerated_ms() const noexcept;
  /// "8.0 MiB, tolerates 1440 ms"; and the next move if less was granted than requested.
  [[nodiscard]] std::string note() const;
  /// Less was granted than requested: a warning if less than half a second is tolerated, else a note.
  [[nodiscard]] std::optional<Finding> finding() const;
};

}  // namespace kphi::netbox
