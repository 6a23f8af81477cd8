#include "drivers/supply/address.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>

#include "drivers/supply/models.hpp"

namespace kphi::supply {
namespace {

constexpr unsigned kBauds[] = {1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600};
constexpr std::string_view kRtu = "modbus-rtu:", kTcp = "modbus-tcp:";
constexpr const char* kForms =
    "write modbus-rtu:/dev/ttyUSB0?baud=115200&slave=1 or modbus-tcp:192.168.1.20:502?slave=1";

[[noreturn]] void refuse(const std::string& uri, const std::string& what, const std::string& next_move = kForms) {
  throw std::invalid_argument(fmt::format("supply \"{}\": {}; {}", uri, what, next_move));
}

/// Decimal digits only: no sign, no blank, nothing after them.
std::optional<unsigned> whole(std::string_view text) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool plain(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 0x7f; });
}

void set_option(Address& address, std::string_view key, std::string_view value) {
  const auto number = whole(value);
  if (key == "baud" && address.wire == Address::Wire::rtu) {
    if (!number || !known_baud(*number)) {
      refuse(address.uri, fmt::format("\"{}\" is no baud rate that can be set", value),
             fmt::format("use one of {}", fmt::join(kBauds, ", ")));
    }
    address.baud = *number;
  } else if (key == "slave") {
    const bool whole_line = address.wire == Address::Wire::tcp && number == 255u;
    if (!number || ((*number < 1 || *number > 247) && !whole_line)) {
      refuse(address.uri, fmt::format("slave \"{}\" is no Modbus address", value), "use 1 to 247; supplies have 1");
    }
    address.slave = static_cast<int>(*number);
  } else if (key == "model") {
    address.model = std::string(value);
    if (find_model(value) == nullptr) {
      refuse(address.uri, fmt::format("no model \"{}\" is known", value),
             fmt::format("use one of {}", fmt::join(model_names(), ", ")));
    }
  } else {
    refuse(address.uri, fmt::format("\"{}\" means nothing here", key),
           address.wire == Address::Wire::rtu ? "there are baud, slave and model" : "there are slave and model");
  }
}

void read_options(Address& address, std::string_view text) {
  std::set<std::string_view> seen;
  while (true) {
    const auto end = std::min(text.find('&'), text.size());
    const std::string_view option = text.substr(0, end);
    const auto equals = option.find('=');
    if (equals == std::string_view::npos) refuse(address.uri, fmt::format("\"{}\" is no key=value", option));
    const std::string_view key = option.substr(0, equals);
    if (!seen.insert(key).second) refuse(address.uri, fmt::format("\"{}\" stands twice", key), "keep one");
    set_option(address, key, option.substr(equals + 1));
    if (end == text.size()) return;
    text.remove_prefix(end + 1);
  }
}

void read_host(Address& address, std::string_view text) {
  const bool bracketed = !text.empty() && text.front() == '[';
  const auto host_end = bracketed ? text.find(']') : std::min(text.find(':'), text.size());
  if (host_end == std::string_view::npos) refuse(address.uri, "the bracket is not closed");
  address.host = std::string(text.substr(bracketed, host_end - bracketed));
  std::string_view rest = text.substr(host_end + bracketed);
  if (address.host.empty()) refuse(address.uri, "the host is missing");
  if (rest.empty()) return;
  const auto port = rest.front() == ':' ? whole(rest.substr(1)) : std::nullopt;
  if (!port || *port < 1 || *port > 65535) refuse(address.uri, fmt::format("\"{}\" is no port", rest), "use :502");
  address.port = *port;
}

}  // namespace

std::string Address::where() const {
  if (wire == Wire::rtu) return device;
  const bool bare = host.find(':') == std::string::npos;
  return bare ? fmt::format("{}:{}", host, port) : fmt::format("[{}]:{}", host, port);
}

bool known_baud(unsigned baud) noexcept {
  return std::find(std::begin(kBauds), std::end(kBauds), baud) != std::end(kBauds);
}

Address parse_address(const std::string& uri) {
  Address address;
  address.uri = uri;
  std::string_view text = uri;
  if (!plain(text)) refuse(uri, "there is a blank or an unprintable character in it");
  if (text.substr(0, kRtu.size()) == kRtu) {
    address.wire = Address::Wire::rtu;
  } else if (text.substr(0, kTcp.size()) == kTcp) {
    address.wire = Address::Wire::tcp;
  } else {
    refuse(uri, "it begins with neither modbus-rtu: nor modbus-tcp:");
  }
  text.remove_prefix(kRtu.size());
  const auto question = text.find('?');
  const std::string_view place = text.substr(0, question);
  if (address.wire == Address::Wire::rtu) {
    if (place.size() < 2 || place.front() != '/') refuse(uri, "the device is no absolute path");
    address.device = std::string(place);
  } else {
    read_host(address, place);
  }
  if (question != std::string_view::npos) read_options(address, text.substr(question + 1));
  if (address.wire == Address::Wire::rtu && address.baud == 0) {
    address.baud = address.model.empty() ? 115200 : find_model(address.model)->map->usual_baud;
  }
  return address;
}

}  // namespace kphi::supply
