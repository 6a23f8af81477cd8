#include "drivers/iq/version.hpp"

#include <fmt/format.h>

namespace kphi::iq {
namespace {

std::string style_text(int style) {
  switch (style) {
    case FirmwareVersion::kSpeed:
      return "speed";
    case 2:
      return "servo";
    case 3:
      return "pulsing";
    case 4:
      return "step/dir";
    case 6:
      return "pulsing velocity";
    default:
      return fmt::format("style {}", style);
  }
}

}  // namespace

std::string FirmwareVersion::text() const { return fmt::format("{} {}.{}.{}", style_text(style), major, minor, patch); }

std::string BoardVersion::text() const { return fmt::format("type {}.{} batch {}", type, major, batch); }

}  // namespace kphi::iq
