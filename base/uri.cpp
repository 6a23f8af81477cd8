#include "base/uri.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "base/number.hpp"

namespace kphi {
namespace {

constexpr std::string_view kUsb = "usb:";

/// False: neither four hexadecimal digits nor '*'.
bool read_id(std::string_view text, std::optional<std::uint16_t>& id) noexcept {
  if (text.size() == 4) id = parse_integer<std::uint16_t>(text, 16);
  return id || text == "*";
}

/// "1-1.2", or with an interface "1-1.2:1.0".
bool is_port_path(std::string_view text) noexcept {
  if (text.empty() || text.find_first_not_of("0123456789-.:") != std::string_view::npos) return false;
  const auto dash = text.find('-');
  return dash != 0 && dash != std::string_view::npos && dash == text.rfind('-') && dash + 1 < text.size() &&
         text.find(':') == text.rfind(':');
}

std::string id_text(const std::optional<std::uint16_t>& id) { return id ? fmt::format("{:04x}", *id) : "*"; }

}  // namespace

std::string HostPort::text() const {
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port) : fmt::format("[{}]:{}", host, port);
}

Uri::Uri(std::string text, std::string device, std::string forms)
    : text_(std::move(text)), device_(std::move(device)), forms_(std::move(forms)) {
  if (!std::ranges::all_of(text_, [](char c) { return c > ' ' && c < 0x7f; }))
    refuse("contains a blank or an unprintable character");
  const auto colon = text_.find(':'), question = text_.find('?');
  if (colon == std::string::npos || colon == 0 || question < colon) refuse("no scheme");
  scheme_ = text_.substr(0, colon);
  location_ = text_.substr(colon + 1, question == std::string::npos ? question : question - colon - 1);
  for (std::size_t at = question; at != std::string::npos;) {
    const auto next = text_.find('&', at + 1);
    const std::string option = text_.substr(at + 1, next == std::string::npos ? next : next - at - 1);
    const auto equals = option.find('=');
    if (equals == std::string::npos) refuse(fmt::format("\"{}\" is not key=value", option));
    const std::string key = option.substr(0, equals);
    if (std::ranges::any_of(options_, [&](const auto& other) { return other.first == key; }))
      refuse(fmt::format("\"{}\" is given twice", key), "keep one");
    options_.emplace_back(key, option.substr(equals + 1));
    at = next;
  }
}

HostPort Uri::host_and_port(std::uint16_t usual_port) const {
  const bool bracketed = location_.starts_with('[');
  const auto end = bracketed ? location_.find(']') : std::min(location_.find(':'), location_.size());
  if (end == std::string::npos) refuse("the bracket is not closed");
  HostPort place{location_.substr(bracketed, end - bracketed), usual_port};
  if (place.host.empty()) refuse("no host given");
  const std::string rest = location_.substr(end + bracketed);
  if (rest.empty()) return place;
  const auto port = rest.front() == ':' ? parse_integer<std::uint16_t>(std::string_view(rest).substr(1)) : std::nullopt;
  if (!port || *port == 0) refuse(fmt::format("\"{}\" is not a port, 1 to 65535", rest));
  place.port = *port;
  return place;
}

void Uri::refuse(const std::string& cause, const std::string& next_move) const {
  throw std::invalid_argument(
      fmt::format("{} \"{}\": {}; {}", device_, text_, cause, next_move.empty() ? forms_ : next_move));
}

std::optional<UsbAddress> UsbAddress::read(std::string_view text) {
  if (!text.starts_with(kUsb)) return std::nullopt;
  text.remove_prefix(kUsb.size());
  UsbAddress address;
  if (const auto at = text.rfind('@'); at != std::string_view::npos && is_port_path(text.substr(at + 1))) {
    address.port_path = text.substr(at + 1);
    text = text.substr(0, at);
  }
  const auto colon = text.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const auto second = text.find(':', colon + 1);
  if (second != std::string_view::npos) {
    address.serial = text.substr(second + 1);
    if (address.serial.empty() || address.serial[0] == ':' || address.serial[0] == '@') return std::nullopt;
    text = text.substr(0, second);
  }
  if (!read_id(text.substr(0, colon), address.vendor)) return std::nullopt;
  if (!read_id(text.substr(colon + 1), address.product)) return std::nullopt;
  return address;
}

UsbAddress UsbAddress::parse(std::string_view text) {
  if (auto address = read(text)) return std::move(*address);
  throw std::invalid_argument(fmt::format(
      "\"{}\" is not a USB device; write usb:VENDOR:PRODUCT in four hexadecimal digits each, then :SERIAL or @PORT if "
      "several are alike (usb:04d8:00dd:0001AB, usb:1a86:7523@1-1.4)",
      text));
}

std::string UsbAddress::text() const {
  return fmt::format("{}{}:{}{}{}{}{}", kUsb, id_text(vendor), id_text(product), serial.empty() ? "" : ":", serial,
                     port_path.empty() ? "" : "@", port_path);
}

bool UsbAddress::fits(std::uint16_t its_vendor, std::uint16_t its_product, std::string_view its_serial) const noexcept {
  return vendor.value_or(its_vendor) == its_vendor && product.value_or(its_product) == its_product &&
         (serial.empty() || serial == its_serial);
}

}  // namespace kphi
