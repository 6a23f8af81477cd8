#include "daq/live/udp_json.hpp"

#include <fmt/format.h>
#include <sys/socket.h>

#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cstring>

#include "base/error.hpp"
#include "base/number.hpp"

namespace kphi::daq::live {
namespace {

using boost::asio::ip::udp;

[[noreturn]] void refuse(const std::string& address, const std::string& why) {
  throw ConfigurationError(
      fmt::format("--udp-json {}: {}; give an address and a port, for PlotJuggler 127.0.0.1:9870", address, why));
}

std::string without_brackets(const std::string& host) {
  if (host == "localhost") return "127.0.0.1";
  return host.size() > 2 && host.front() == '[' && host.back() == ']' ? host.substr(1, host.size() - 2) : host;
}

udp::endpoint endpoint_of(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) refuse(text, "no port given");
  const auto port = parse_integer<std::uint16_t>(std::string_view(text).substr(colon + 1));
  if (port.value_or(0) == 0) refuse(text, "the port must be 1 to 65535");
  boost::system::error_code failed;
  const auto address = boost::asio::ip::make_address(without_brackets(text.substr(0, colon)), failed);
  if (failed) refuse(text, "the host must be a numeric address");
  const bool everybody = address.is_v4() && address.to_v4() == boost::asio::ip::address_v4::broadcast();
  if (address.is_unspecified() || address.is_multicast() || everybody) refuse(text, "must be a unicast address");
  return {address, *port};
}

}  // namespace

UdpJson::UdpJson(const std::string& address, std::vector<GuardLimit> limits) : limits_(std::move(limits)) {
  const udp::endpoint to = endpoint_of(address);
  socket_ = Descriptor(::socket(to.protocol().family(), SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (socket_.number() < 0 || ::connect(socket_.number(), to.data(), static_cast<socklen_t>(to.size())) != 0)
    refuse(address, std::strerror(errno));
}

void UdpJson::send(const Tick& tick) noexcept {
  try {
    const std::string message = plot_message(tick, limits_);
    (void)::send(socket_.number(), message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  } catch (const std::exception&) {
    // A plotter is worth no run.
  }
}

}  // namespace kphi::daq::live
