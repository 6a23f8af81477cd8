// One JSON datagram per tick for PlotJuggler (its UDP server, message protocol "json", timestamp field "timestamp").
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "daq/live/limit_bars.hpp"
#include "daq/live/tick.hpp"

namespace kphi::daq::live {

class UdpJson {
 public:
  /// "127.0.0.1:9870", "localhost:9870", "[::1]:9870" or another machine's address: a number, never a name that must be
  /// looked up, never all or many machines at once. Throws ConfigurationError.
  UdpJson(const std::string& address, std::vector<LimitBar> limits);
  ~UdpJson();
  UdpJson(const UdpJson&) = delete;
  UdpJson& operator=(const UdpJson&) = delete;
  /// What limit_share is of, from now on.
  void hold_to(std::vector<LimitBar> limits) { limits_ = std::move(limits); }
  /// Never waits; what the kernel does not take is dropped and counted.
  void send(const Tick& tick) noexcept;
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  std::vector<LimitBar> limits_;
  int socket_ = -1;
  std::uint64_t dropped_ = 0;
};

}  // namespace kphi::daq::live
