#include "drivers/iq/wire/entries.hpp"

#include <bit>
#include <cmath>

namespace kphi::iq {
namespace {

std::uint32_t read_little_endian(std::span<const std::uint8_t> data) noexcept {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < data.size(); ++i) bits |= static_cast<std::uint32_t>(data[i]) << (8 * i);
  return bits;
}

template <class Integer>
std::uint32_t bits_of_nearest(double value) noexcept {
  constexpr double lowest = std::numeric_limits<Integer>::min();
  constexpr double highest = std::numeric_limits<Integer>::max();
  if (!(value > lowest)) return static_cast<std::uint32_t>(std::numeric_limits<Integer>::min());
  if (value >= highest) return static_cast<std::uint32_t>(std::numeric_limits<Integer>::max());
  return static_cast<std::uint32_t>(static_cast<Integer>(std::nearbyint(value)));
}

std::uint32_t bits_of(Format format, double value) noexcept {
  switch (format) {
    case Format::i8:
      return bits_of_nearest<std::int8_t>(value);
    case Format::u8:
      return bits_of_nearest<std::uint8_t>(value);
    case Format::u16:
      return bits_of_nearest<std::uint16_t>(value);
    case Format::u32:
      return bits_of_nearest<std::uint32_t>(value);
    case Format::i32:
      return bits_of_nearest<std::int32_t>(value);
    case Format::f32:
      return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    case Format::none:
    case Format::bytes16:
      break;
  }
  return 0;
}

}  // namespace

double number(Format format, std::span<const std::uint8_t> data) noexcept {
  if (data.size() != size_of(format)) return std::nan("");
  switch (format) {
    case Format::i8:
      return static_cast<std::int8_t>(data[0]);
    case Format::u8:
    case Format::u16:
    case Format::u32:
      return read_little_endian(data);
    case Format::i32:
      return static_cast<std::int32_t>(read_little_endian(data));
    case Format::f32:
      return std::bit_cast<float>(read_little_endian(data));
    case Format::none:
    case Format::bytes16:
      break;
  }
  return std::nan("");
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
  for (std::size_t i = 0; i < size && i < 4; ++i) packet.payload[2 + i] = static_cast<std::uint8_t>(bits >> (8 * i));
  packet.length = static_cast<std::uint8_t>(2 + size);
  return packet;
}

bool is_volatile_setting(const Entry& wanted) noexcept {
  if (&wanted == &entry<"system_control.time"> || &wanted == &entry<"power_safety.fault_ever">) return true;
  if (wanted.type == Client::system_control) return false;
  const bool calibrated = wanted.type == Client::brushless_drive && wanted.sub >= 14 && wanted.sub <= 18;
  return wanted.permitted == kGetSetSave && !calibrated;
}

bool is_as_set(const Entry& asked, double wanted, double read) noexcept {
  return wanted == read || make(asked, Access::set, 0, wanted) == make(asked, Access::set, 0, read);
}

}  // namespace kphi::iq
