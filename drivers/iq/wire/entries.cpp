#include "drivers/iq/wire/entries.hpp"

#include <bit>
#include <cmath>
#include <utility>

namespace kphi::iq {
namespace {

/// Smallest and largest number of an integer format.
std::pair<double, double> range_of(Format format) noexcept {
  const bool is_signed = format == Format::i8 || format == Format::i32;
  const double codes = std::exp2(8 * size_of(format));
  return is_signed ? std::pair(-codes / 2, codes / 2 - 1) : std::pair(0.0, codes - 1);
}

std::uint32_t bits_of(Format format, double value) noexcept {
  if (format == Format::f32) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  const auto [lowest, highest] = range_of(format);
  const double held = value > lowest ? std::min(value, highest) : lowest;  // NaN: the lowest
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(std::nearbyint(held)));
}

}  // namespace

double number(Format format, std::span<const std::uint8_t> data) noexcept {
  if (format == Format::none || data.size() != size_of(format)) return std::nan("");
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < data.size(); ++i) bits |= static_cast<std::uint32_t>(data[i]) << (8 * i);
  if (format == Format::f32) return std::bit_cast<float>(bits);
  if (format == Format::i8) return static_cast<std::int8_t>(bits);
  return format == Format::i32 ? static_cast<std::int32_t>(bits) : static_cast<double>(bits);
}

Packet make(const Entry& entry, Access access, int module_id, double value) {
  Packet packet;
  packet.type = static_cast<std::uint8_t>(entry.type);
  packet.payload[0] = entry.sub;
  packet.payload[1] = static_cast<std::uint8_t>(module_id << 2 | static_cast<int>(access));
  packet.length = 2;
  if (access != Access::set && access != Access::reply) return packet;
  const std::uint32_t bits = bits_of(entry.format, value);
  const std::size_t size = size_of(entry.format);
  for (std::size_t i = 0; i < size; ++i) packet.payload[2 + i] = static_cast<std::uint8_t>(bits >> (8 * i));
  packet.length = static_cast<std::uint8_t>(2 + size);
  return packet;
}

bool is_volatile_setting(const Entry& wanted) noexcept {
  if (&wanted == &entry<"system_control.time"> || &wanted == &entry<"power_safety.fault_ever">) return true;
  if (wanted.type == Client::system_control) return false;
  return wanted.permitted == kGetSetSave && &wanted != &entry<"brushless_drive.motor_pole_pairs">;
}

bool is_as_set(const Entry& asked, double wanted, double read) noexcept {
  return wanted == read || make(asked, Access::set, 0, wanted) == make(asked, Access::set, 0, read);
}

}  // namespace kphi::iq
