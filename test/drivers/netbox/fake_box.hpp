// A box for the driver's tests: real sockets on loopback, port 0, its own bytes, and verbs for trouble. Not the
// simulator (drivers/sim), which has physics; this one has none.
#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "test/drivers/netbox/record_bytes.hpp"

namespace kphi::netbox::test {

/// A socket on a free port of loopback.
class LoopbackSocket {
 public:
  explicit LoopbackSocket(int type) : descriptor_(::socket(AF_INET, type | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    if (descriptor_ < 0 || bind(descriptor_, reinterpret_cast<sockaddr*>(&address), length) != 0 ||
        getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &length) != 0)
      throw std::runtime_error("no loopback socket");
    port_ = ntohs(address.sin_port);
  }
  ~LoopbackSocket() { close(descriptor_); }
  LoopbackSocket(const LoopbackSocket&) = delete;
  LoopbackSocket& operator=(const LoopbackSocket&) = delete;
  int descriptor() const { return descriptor_; }
  std::uint16_t port() const { return port_; }

 private:
  int descriptor_;
  std::uint16_t port_ = 0;
};

inline std::uint16_t closed_port(int type) { return LoopbackSocket(type).port(); }

/// Serves one fixed answer per connection, in pieces, and closes.
class FakeWeb {
 public:
  struct Manner {
    std::vector<std::string> pieces;
    std::chrono::milliseconds before_each{0};
    bool keep_open = false;  ///< after the last piece, until the end of this object
    std::function<std::string(const std::string& request)> answer = nullptr;  ///< instead of the pieces
    bool reset = false;  ///< ends with a reset behind the last piece
  };

  explicit FakeWeb(Manner manner) : manner_(std::move(manner)), socket_(SOCK_STREAM) {
    if (listen(socket_.descriptor(), 8) != 0) throw std::runtime_error("listen");
    thread_ = std::jthread([this](const std::stop_token& end) { serve(end); });
  }
  ~FakeWeb() {
    thread_.request_stop();
    shutdown(socket_.descriptor(), SHUT_RDWR);
  }
  std::uint16_t port() const { return socket_.port(); }
  /// First line and headers of the last request.
  std::string last_request() const { return last_request_; }

  static Manner page(const std::string& body, const std::string& status = "200 OK") {
    return {{"HTTP/1.0 " + status + "\r\nContent-Type: text/xml\r\nContent-Length: " + std::to_string(body.size()) +
             "\r\n\r\n" + body}};
  }

 private:
  void serve(const std::stop_token& end) {
    while (!end.stop_requested()) {
      const int client = accept(socket_.descriptor(), nullptr, nullptr);
      if (client < 0) return;
      answer(client, end);
      close(client);
    }
  }
  void answer(int client, const std::stop_token& end) {
    std::string request;
    char bytes[1024];
    while (request.find("\r\n\r\n") == std::string::npos) {
      const ssize_t count = recv(client, bytes, sizeof bytes, 0);
      if (count <= 0) return;
      request.append(bytes, static_cast<std::size_t>(count));
    }
    last_request_ = request;
    if (manner_.answer) manner_.pieces = {manner_.answer(request)};
    for (const std::string& piece : manner_.pieces) {
      pause(manner_.before_each, end);
      if (send(client, piece.data(), piece.size(), MSG_NOSIGNAL) < 0) return;
    }
    if (manner_.reset) {
      const linger at_once{1, 0};
      setsockopt(client, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
      return;  // to be closed
    }
    shutdown(client, manner_.keep_open ? SHUT_RD : SHUT_WR);
    if (manner_.keep_open) pause(std::chrono::hours(1), end);
    while (!manner_.keep_open && !end.stop_requested() && recv(client, bytes, sizeof bytes, 0) > 0) {
    }
  }
  /// A box that answers late; the end of a test does not wait for it.
  static void pause(std::chrono::milliseconds duration, const std::stop_token& end) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any().wait_for(lock, end, duration, [] { return false; });
  }

  Manner manner_;
  LoopbackSocket socket_;
  std::string last_request_;
  std::jthread thread_;
};

/// Streams on request, at its rate, to whoever asked last. Counts what it was told.
class FakeBox {
 public:
  struct Manner {
    unsigned records_per_datagram = 40;
    unsigned divisor = 1;
    double speed = 1;        ///< times as fast as a true box
    int starts_ignored = 0;  ///< as if they had been lost
    int stops_ignored = 0;
    std::uint32_t first_ft = 1000;
    unsigned skip_every = 0;       ///< every so many datagrams one is not sent
    bool mute_after_1000 = false;  ///< sends 1000 records and no more
    std::int32_t load = 0;         ///< Fz in counts, until a bias
    bool bias_works = true;
    bool bias_stops = false;  ///< and then the stream
  };

  explicit FakeBox(Manner manner) : manner_(manner), socket_(SOCK_DGRAM), ft_(manner.first_ft) {
    thread_ = std::thread([this] { live(); });
  }
  ~FakeBox() {
    ending_ = true;
    thread_.join();
  }
  std::uint16_t port() const { return socket_.port(); }
  int starts() const { return starts_; }
  int stops() const { return stops_; }
  bool streaming() const { return streaming_; }
  std::uint64_t sent() const { return sent_; }        ///< records
  std::uint64_t skipped() const { return skipped_; }  ///< records
  int biases() const { return biases_; }
  int settings_written() const { return strange_; }  ///< datagrams that are neither start nor stop nor bias

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  void live() {
    prctl(PR_SET_TIMERSLACK, 1);
    while (!ending_) {
      pollfd readable{socket_.descriptor(), POLLIN, 0};
      const timespec sleep_time{0, streaming_ ? until_next_ns() : 2'000'000};
      if (ppoll(&readable, 1, &sleep_time, nullptr) > 0) apply();
      if (streaming_) send_what_is_due();
    }
  }
  void apply() {
    std::uint8_t request[64];
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t size = recvfrom(socket_.descriptor(), request, sizeof request, MSG_DONTWAIT,
                                  reinterpret_cast<sockaddr*>(&from), &length);
    if (size != 8 || request[0] != 0x12 || request[1] != 0x34) return;
    const int command = request[2] << 8 | request[3];
    if (command == 0) {
      ++stops_;
      if (manner_.stops_ignored > 0) {
        --manner_.stops_ignored;
      } else {
        streaming_ = false;
      }
    } else if (command == 2 || command == 3) {
      ++starts_;
      if (manner_.starts_ignored-- > 0) return;
      peer_ = from;
      records_ = command == 3 ? manner_.records_per_datagram : 1;
      rdt_ = 1;
      datagrams_ = 0;
      begun_ = std::chrono::steady_clock::now();
      streaming_ = true;
    } else if (command == 0x42) {
      ++biases_;
      if (manner_.bias_works) manner_.load = 0;
      if (manner_.bias_stops) streaming_ = false;
    } else {
      ++strange_;
    }
  }
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count(); }
  double datagrams_per_second() const { return manner_.speed * 7000.0 / manner_.divisor / records_; }
  /// A true box sends evenly; one in haste sends what has come together in 300 us.
  long until_next_ns() const {
    if (datagrams_per_second() > 10'000) return 300'000;
    const double left = static_cast<double>(datagrams_ + 1) / datagrams_per_second() - seconds();
    return std::clamp(static_cast<long>(1e9 * left), 0L, 2'000'000L);
  }
  void send_what_is_due() {
    const auto due = static_cast<std::uint64_t>(seconds() * datagrams_per_second());
    for (; datagrams_ < due; ++datagrams_) {
      if (manner_.mute_after_1000 && rdt_ > 1000) return;
      Bytes bytes;
      for (unsigned i = 0; i < records_; ++i) put_record(bytes, rdt_ + i, ft_ + i * manner_.divisor, 0, manner_.load);
      rdt_ += records_;
      ft_ += records_ * manner_.divisor;
      if (manner_.skip_every && datagrams_ % manner_.skip_every == manner_.skip_every - 1) {
        skipped_ += records_;
        continue;
      }
      sent_ += records_;
      sendto(socket_.descriptor(), bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&peer_), sizeof peer_);
    }
  }

  Manner manner_;
  LoopbackSocket socket_;
  sockaddr_in peer_{};
  std::uint32_t rdt_ = 1, ft_;
  unsigned records_ = 1;
  std::uint64_t datagrams_ = 0;
  SteadyTime begun_;
  std::atomic<bool> ending_{false}, streaming_{false};
  std::atomic<int> starts_{0}, stops_{0}, strange_{0}, biases_{0};
  std::atomic<std::uint64_t> sent_{0}, skipped_{0};
  std::thread thread_;
};

}  // namespace kphi::netbox::test
