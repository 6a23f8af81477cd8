#include "drivers/usb/address.hpp"

#include <fmt/format.h>

#include <charconv>
#include <stdexcept>

namespace kphi::usb {
namespace {

constexpr std::string_view kScheme = "usb:";

[[noreturn]] void refuse(std::string_view text) {
  throw std::invalid_argument(
      fmt::format("\"{}\" is no USB device; write usb:VENDOR:PRODUCT in four hexadecimal digits each, then :SERIAL or "
                  "@PORT if several are alike (usb:04d8:00dd:0001AB, usb:1a86:7523@1-1.4)",
                  text));
}

bool four_hex_digits(std::string_view text, std::uint16_t& value) noexcept {
  if (text.size() != 4) return false;
  const auto [end, error] = std::from_chars(text.data(), text.data() + 4, value, 16);
  return error == std::errc() && end == text.data() + 4;
}

}  // namespace

Address Address::parse(std::string_view text) {
  Address address;
  std::string_view rest = text;
  if (!rest.starts_with(kScheme)) refuse(text);
  rest.remove_prefix(kScheme.size());
  if (rest.size() < 9 || rest[4] != ':' || !four_hex_digits(rest.substr(0, 4), address.vendor) ||
      !four_hex_digits(rest.substr(5, 4), address.product)) {
    refuse(text);
  }
  rest.remove_prefix(9);
  const std::size_t at = rest.rfind('@');
  if (at != std::string_view::npos) {
    address.port_path = rest.substr(at + 1);
    if (address.port_path.empty()) refuse(text);
    rest = rest.substr(0, at);
  }
  if (!rest.empty()) {
    if (rest.front() != ':' || rest.size() == 1) refuse(text);
    address.serial = rest.substr(1);
  }
  return address;
}

std::string Address::text() const {
  return fmt::format("usb:{:04x}:{:04x}{}{}{}{}", vendor, product, serial.empty() ? "" : ":", serial,
                     port_path.empty() ? "" : "@", port_path);
}

bool fits(const Address& wanted, const Listing& found) noexcept {
  return wanted.vendor == found.vendor && wanted.product == found.product &&
         (wanted.serial.empty() || wanted.serial == found.serial) &&
         (wanted.port_path.empty() || wanted.port_path == found.port_path);
}

std::string to_string(const Listing& l) {
  return fmt::format("{:04x}:{:04x}{}{}, port {}{}", l.vendor, l.product, l.serial.empty() ? "" : ", serial ", l.serial,
                     l.port_path, l.readable ? "" : " (not readable by this user)");
}

}  // namespace kphi::usb
