#include "drivers/scpi/place.hpp"

#include <fmt/format.h>

#include <charconv>
#include <stdexcept>

#include "drivers/scpi/scpi_supply.hpp"
#include "drivers/scpi/tcp.hpp"
#include "drivers/scpi/usbtmc.hpp"
#include "drivers/usb/bus.hpp"

namespace kphi::scpi {
namespace {

constexpr std::string_view kTcp = "scpi-tcp:", kUsb = "scpi-usb:";
constexpr std::uint16_t kCustomaryPort = 5025;

/// Bus, device and conversation, which die in the opposite order.
class UsbLine final : public Line {
 public:
  explicit UsbLine(const usb::Address& address) : device_(bus_.open(address)), line_(*device_) {}
  void write(std::string_view command) override { line_.write(command); }
  [[nodiscard]] std::string query(std::string_view command) override { return line_.query(command); }
  [[nodiscard]] const std::string& name() const noexcept override { return line_.name(); }
  [[nodiscard]] LineCounters counters() const noexcept override { return line_.counters(); }

 private:
  usb::Bus bus_;
  std::unique_ptr<usb::Transport> device_;
  Usbtmc line_;
};

struct OwnedLine {
  std::unique_ptr<Line> line;
};

class OwningSupply final : private OwnedLine, public ScpiSupply {
 public:
  OwningSupply(std::unique_ptr<Line> owned, const Clock& clock)
      : OwnedLine{std::move(owned)}, ScpiSupply(*OwnedLine::line, clock) {}
};

std::unique_ptr<Line> open_tcp(const std::string& uri) {
  const std::string where = uri.substr(kTcp.size());
  const std::size_t colon = where.rfind(':');
  const std::string host = where.substr(0, colon);
  std::uint16_t port = kCustomaryPort;
  bool whole = true;
  if (colon != std::string::npos) {
    const char* const end = where.data() + where.size();
    const auto [stop, error] = std::from_chars(where.data() + colon + 1, end, port);
    whole = error == std::errc() && stop == end && port > 0;
  }
  if (host.empty() || !whole)
    throw std::invalid_argument(fmt::format("\"{}\" names no host and port; write scpi-tcp:HOST:5025", uri));
  return std::make_unique<Tcp>(host, port);
}

}  // namespace

bool is_scpi(std::string_view uri) noexcept { return uri.starts_with(kTcp) || uri.starts_with(kUsb); }

std::unique_ptr<Line> open_line(const std::string& uri) {
  if (uri.starts_with(kTcp)) return open_tcp(uri);
  if (uri.starts_with(kUsb)) return std::make_unique<UsbLine>(usb::Address::parse("usb:" + uri.substr(kUsb.size())));
  throw std::invalid_argument(
      fmt::format("\"{}\" is no SCPI instrument; write scpi-tcp:HOST:5025 or scpi-usb:VID:PID", uri));
}

std::unique_ptr<supply::Supply> open_supply(const std::string& uri, const Clock& clock) {
  return std::make_unique<OwningSupply>(open_line(uri), clock);
}

}  // namespace kphi::scpi
