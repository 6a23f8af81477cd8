#include "drivers/iq/wire/identity.hpp"

#include <fmt/format.h>

#include <iterator>

namespace kphi::iq {
namespace {

std::string style_text(int style) {
  constexpr const char* names[] = {"", "speed", "servo", "pulsing", "step/dir", "", "pulsing velocity"};
  const bool known = style >= 0 && style < static_cast<int>(std::size(names)) && *names[style] != 0;
  return known ? names[style] : fmt::format("style {}", style);
}

}  // namespace

std::string FirmwareVersion::text() const { return fmt::format("{} {}.{}.{}", style_text(style), major, minor, patch); }

std::string BoardVersion::text() const { return fmt::format("type {}.{} batch {}", type, major, batch); }

std::string Identity::firmware_text() const { return FirmwareVersion(firmware).text(); }

std::string Identity::uid_text() const { return fmt::format("{:08x}{:08x}{:08x}", uid1, uid2, uid3); }

std::string Identity::summary() const {
  std::string text =
      fmt::format("firmware {}, hardware {}, electronics {}, uid {}, timeout {} s, ", firmware_text(),
                  BoardVersion(hardware).text(), BoardVersion(electronics).text(), uid_text(), timeout_s);
  text += coil_temperature_client == 0 ? std::string("no coil temperature")
                                       : fmt::format("coil temperature from client {}", coil_temperature_client);
  if (!timeout_behavior_set) text += ", old firmware: plays its song after a timeout";
  if (fault_now != 0) text += fmt::format(", FAULT bits {:#04x}", fault_now);
  return text;
}

}  // namespace kphi::iq
