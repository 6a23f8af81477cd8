// One JSON datagram per tick for PlotJuggler (its UDP server, message protocol "json", timestamp field "timestamp").
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/descriptor.hpp"
#include "daq/live/messages.hpp"

namespace kphi::daq::live {

class UdpJson {
 public:
  /// "127.0.0.1:9870", "localhost:9870", "[::1]:9870" or another computer's address: numeric, so that no name is
  /// resolved, and unicast. Throws ConfigurationError.
  UdpJson(const std::string& address, std::vector<GuardLimit> limits);
  /// From now on limit_share refers to these limits.
  void hold_to(std::vector<GuardLimit> limits) { limits_ = std::move(limits); }
  /// Never waits; a datagram that the kernel refuses is dropped.
  void send(const Tick& tick) noexcept;

 private:
  std::vector<GuardLimit> limits_;
  Descriptor socket_;
};

}  // namespace kphi::daq::live
