#include "drivers/supply/address.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "base/uri.hpp"
#include "drivers/supply/models.hpp"

namespace kphi::supply {
namespace {

constexpr unsigned kBauds[] = {1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600};
constexpr const char* kForms =
    "write modbus-rtu:/dev/ttyUSB0?baud=115200&slave=1 or modbus-tcp:192.168.1.20:502?slave=1";

void set_option(Address& address, const Uri& uri, const std::string& key, const std::string& value) {
  const auto number = parse_whole(value);
  const bool rtu = address.wire == Address::Wire::rtu;
  if (key == "baud" && rtu) {
    if (!number || !known_baud(*number))
      uri.refuse(fmt::format("\"{}\" is not a baud rate that can be set", value),
                 fmt::format("use one of {}", fmt::join(kBauds, ", ")));
    address.baud = *number;
  } else if (key == "slave") {
    const bool unit_of_tcp = !rtu && number == 255u;
    if (!number || ((*number < 1 || *number > 247) && !unit_of_tcp))
      uri.refuse(fmt::format("slave \"{}\" is not a Modbus address", value), "use 1 to 247; the default is 1");
    address.slave = static_cast<int>(*number);
  } else if (key == "model") {
    if (find_model(value) == nullptr)
      uri.refuse(fmt::format("unknown model \"{}\"", value),
                 fmt::format("use one of {}", fmt::join(model_names(), ", ")));
    address.model = value;
  } else {
    uri.refuse(fmt::format("unknown option \"{}\"", key), rtu ? "use baud, slave or model" : "use slave or model");
  }
}

}  // namespace

std::string Address::where() const { return wire == Wire::rtu ? device : tcp.text(); }

bool known_baud(unsigned baud) noexcept {
  return std::find(std::begin(kBauds), std::end(kBauds), baud) != std::end(kBauds);
}

Address parse_address(const std::string& text) {
  const Uri uri(text, "supply", kForms);
  Address address;
  address.uri = text;
  if (uri.scheme() == "modbus-rtu") {
    if (uri.location().size() < 2 || uri.location().front() != '/') uri.refuse("the device is not an absolute path");
    address.device = uri.location();
  } else if (uri.scheme() == "modbus-tcp") {
    address.wire = Address::Wire::tcp;
    address.tcp = uri.host_and_port(502);
  } else {
    uri.refuse(fmt::format("unknown scheme \"{}:\"", uri.scheme()));
  }
  for (const auto& [key, value] : uri.options()) set_option(address, uri, key, value);
  if (address.wire == Address::Wire::rtu && address.baud == 0)
    address.baud = address.model.empty() ? 115200 : find_model(address.model)->map->usual_baud;
  return address;
}

}  // namespace kphi::supply
