// Numbers as they lie in binary logs: little-endian, not aligned.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

namespace kphi::fit {

static_assert(std::endian::native == std::endian::little, "numbers are read as they lie in the file");

/// The first sizeof(T) bytes; `bytes` has them.
template <class T>
[[nodiscard]] T raw(std::string_view bytes) {
  T value{};
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

/// The same, and takes them off the front; nullopt if there are fewer.
template <class T>
[[nodiscard]] std::optional<T> take_raw(std::string_view& bytes) {
  if (bytes.size() < sizeof(T)) return std::nullopt;
  const T value = raw<T>(bytes);
  bytes.remove_prefix(sizeof(T));
  return value;
}

/// IEEE 754 binary16.
[[nodiscard]] inline double half(std::uint16_t bits) {
  const int exponent = (bits >> 10) & 0x1F, fraction = bits & 0x3FF;
  const double size = exponent == 31  ? (fraction == 0 ? INFINITY : NAN)
                      : exponent == 0 ? std::ldexp(fraction, -24)
                                      : std::ldexp(fraction + 1024, exponent - 25);
  return (bits & 0x8000) != 0 ? -size : size;
}

struct RawType {
  std::string_view name;  ///< in ULog; empty: it has none there
  char letter;            ///< in Python's struct, by which a card log names it; '\0': not there
  std::uint8_t bytes;
  double (*read)(std::string_view);
};

template <class T>
double read_raw(std::string_view bytes) {
  return static_cast<double>(raw<T>(bytes));
}

inline constexpr RawType kRawTypes[]{
    {"int8_t", 'b', 1, read_raw<std::int8_t>},
    {"uint8_t", 'B', 1, read_raw<std::uint8_t>},
    {"bool", '?', 1, read_raw<std::uint8_t>},
    {"char", 'c', 1, read_raw<std::uint8_t>},
    {"int16_t", 'h', 2, read_raw<std::int16_t>},
    {"uint16_t", 'H', 2, read_raw<std::uint16_t>},
    {"int32_t", 'i', 4, read_raw<std::int32_t>},
    {"uint32_t", 'I', 4, read_raw<std::uint32_t>},
    {"", 'l', 4, read_raw<std::int32_t>},
    {"", 'L', 4, read_raw<std::uint32_t>},
    {"int64_t", 'q', 8, read_raw<std::int64_t>},
    {"uint64_t", 'Q', 8, read_raw<std::uint64_t>},
    {"", 'e', 2, [](std::string_view bytes) { return half(raw<std::uint16_t>(bytes)); }},
    {"float", 'f', 4, read_raw<float>},
    {"double", 'd', 8, read_raw<double>}};

}  // namespace kphi::fit
