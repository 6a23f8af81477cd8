#include "drivers/scpi/line.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "base/uri.hpp"

namespace kphi::scpi {
namespace {

constexpr std::string_view kTcp = "scpi-tcp", kUsb = "scpi-usb";
constexpr std::uint16_t kUsualPort = 5025;

struct OpenDevice {
  explicit OpenDevice(const UsbAddress& address) : device(bus.open(address)) {}
  usb::Bus bus;
  std::unique_ptr<usb::Transport> device;
};

/// Owns bus and device, which outlive the conversation.
class UsbLine final : OpenDevice, public Usbtmc {
 public:
  explicit UsbLine(const UsbAddress& address) : OpenDevice(address), Usbtmc(*device) {}
};

}  // namespace

Tcp::Tcp(std::string host, std::uint16_t port, std::chrono::milliseconds timeout)
    : host_(std::move(host)), port_(port), timeout_(timeout), name_(fmt::format("instrument {}:{}", host_, port)) {
  connect();
}

void Tcp::connect() {
  connection_.emplace(timeout_);
  received_.clear();
  carry_out("connect", [this] { connection_->connect(host_, port_); });
}

void Tcp::write(std::string_view command) {
  if (!connection_) connect();
  carry_out(command, [&] { connection_->send(std::string(command) + "\n"); });
}

std::string Tcp::query(std::string_view command) {
  // Unrequested bytes are not the answer to this query.
  if (!received_.empty()) connection_.reset();
  write(command);
  std::size_t end = std::string::npos;
  carry_out(command, [&] {
    while ((end = received_.find('\n')) == std::string::npos && received_.size() <= kLongestAnswer) {
      if (!connection_->receive(received_))
        throw TcpError(TcpError::Cause::other, "the instrument closed the connection");
    }
  });
  if (end == std::string::npos) fail(command, "the answer does not end", "");
  std::string answer = received_.substr(0, end);
  received_.erase(0, end + 1);
  while (!answer.empty() && answer.back() == '\r') answer.pop_back();
  return answer;
}

void Tcp::carry_out(std::string_view operation, auto&& work) {
  try {
    connection_->allow(timeout_);
    work();
  } catch (const TcpError& error) {
    fail(operation, error.what(),
         error.cause == TcpError::Cause::timeout ? "check that the instrument knows this command"
                                                 : "check its power and its network address");
  }
}

void Tcp::fail(std::string_view operation, const std::string& cause, const char* next_move) {
  connection_.reset();
  throw DeviceError(name_, std::string(operation), cause, next_move);
}

bool is_scpi(std::string_view uri) noexcept {
  const std::string_view scheme = uri.substr(0, uri.find(':'));
  return scheme.size() < uri.size() && (scheme == kTcp || scheme == kUsb);
}

std::unique_ptr<Line> open_line(const std::string& text) {
  const Uri uri(text, "instrument", "write scpi-tcp:HOST:5025 or scpi-usb:VID:PID");
  if (!uri.options().empty()) uri.refuse("no options are known");
  if (uri.scheme() == kUsb) return std::make_unique<UsbLine>(UsbAddress::parse("usb:" + uri.location()));
  if (uri.scheme() != kTcp) uri.refuse(fmt::format("unknown scheme \"{}:\"", uri.scheme()));
  const HostPort address = uri.host_and_port(kUsualPort);
  return std::make_unique<Tcp>(address.host, address.port);
}

}  // namespace kphi::scpi
