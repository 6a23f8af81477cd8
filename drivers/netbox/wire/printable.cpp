#include "drivers/netbox/wire/printable.hpp"

#include <cstdint>

namespace kphi::netbox {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

struct Form {
  unsigned char mask, lead;
  std::size_t size;
  std::uint32_t least;  ///< what a shorter form could say is none of this
};
constexpr Form kForms[] = {
    {0x80, 0x00, 1, 0x20}, {0xE0, 0xC0, 2, 0xA0}, {0xF0, 0xE0, 3, 0x800}, {0xF8, 0xF0, 4, 0x10000}};

bool is_character(std::uint32_t code) {
  return code != 0x7F && code <= 0x10FFFF && !(code >= 0xD800 && code <= 0xDFFF);
}

/// Size of the printable character at the begin of `text`; 0: there is none.
std::size_t character_size(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  for (const Form& form : kForms) {
    if ((byte(0) & form.mask) != form.lead) continue;
    if (text.size() < form.size) return 0;
    std::uint32_t code = byte(0) & static_cast<unsigned char>(~form.mask);
    for (std::size_t i = 1; i < form.size; ++i) {
      if ((byte(i) & 0xC0) != 0x80) return 0;
      code = code << 6 | (byte(i) & 0x3Fu);
    }
    return code >= form.least && is_character(code) ? form.size : 0;
  }
  return 0;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t size = character_size(text);
    out += size > 0 ? text.substr(0, size) : kReplacement;
    text.remove_prefix(size > 0 ? size : 1);
  }
  return out;
}

}  // namespace kphi::netbox
