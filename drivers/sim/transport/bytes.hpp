// Numbers to bytes and back, for the simulated ends of the wires only: the Net Box is big-endian, the motor
// little-endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace kphi::sim {

/// The lowest `size` bytes of it, at the end of a string or a vector of bytes.
template <class Bytes>
void append_big(Bytes& out, std::uint32_t value, int size) {
  while (size-- > 0) out.push_back(static_cast<typename Bytes::value_type>(value >> (8 * size)));
}

inline void put_little(std::uint8_t* to, std::uint32_t value, std::size_t size) noexcept {
  for (std::size_t i = 0; i < size; ++i) to[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

[[nodiscard]] inline std::uint32_t little(std::span<const std::uint8_t> bytes) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes.size() && i < 4; ++i) value |= static_cast<std::uint32_t>(bytes[i]) << (8 * i);
  return value;
}

}  // namespace kphi::sim
