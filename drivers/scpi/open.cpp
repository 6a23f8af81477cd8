#include "drivers/scpi/open.hpp"

#include <fmt/format.h>

#include "base/uri.hpp"
#include "drivers/scpi/scpi_supply.hpp"
#include "drivers/scpi/tcp.hpp"
#include "drivers/scpi/usbtmc.hpp"
#include "drivers/usb/bus.hpp"

namespace kphi::scpi {
namespace {

constexpr std::string_view kTcp = "scpi-tcp", kUsb = "scpi-usb";
constexpr std::uint16_t kUsualPort = 5025;

/// Bus, device and conversation, destroyed in the opposite order.
class UsbLine final : public Line {
 public:
  explicit UsbLine(const UsbAddress& address) : device_(bus_.open(address)), line_(*device_) {}
  void write(std::string_view command) override { line_.write(command); }
  [[nodiscard]] std::string query(std::string_view command) override { return line_.query(command); }
  [[nodiscard]] const std::string& name() const noexcept override { return line_.name(); }
  [[nodiscard]] LineCounters counters() const noexcept override { return line_.counters(); }

 private:
  usb::Bus bus_;
  std::unique_ptr<usb::Transport> device_;
  Usbtmc line_;
};

}  // namespace

bool is_scpi(std::string_view uri) noexcept {
  const std::string_view scheme = uri.substr(0, uri.find(':'));
  return scheme.size() < uri.size() && (scheme == kTcp || scheme == kUsb);
}

std::unique_ptr<Line> open_line(const std::string& text) {
  const Uri uri(text, "instrument", "write scpi-tcp:HOST:5025 or scpi-usb:VID:PID");
  if (!uri.options().empty()) uri.refuse("no options are known");
  if (uri.scheme() == kUsb) return std::make_unique<UsbLine>(UsbAddress::parse("usb:" + uri.location()));
  if (uri.scheme() != kTcp) uri.refuse(fmt::format("unknown scheme \"{}:\"", uri.scheme()));
  const HostPort place = uri.host_and_port(kUsualPort);
  return std::make_unique<Tcp>(place.host, place.port);
}

std::unique_ptr<supply::Supply> open_supply(const std::string& uri, const Clock& clock) {
  return std::make_unique<ScpiSupply>(open_line(uri), clock);
}

}  // namespace kphi::scpi
