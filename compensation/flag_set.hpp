// Any number of the flags of an enumeration whose enumerators are bits.
#pragma once

#include <cstdint>

namespace kphi::compensation {

template <class Flag>
class FlagSet {
 public:
  constexpr FlagSet() noexcept = default;
  [[nodiscard]] constexpr bool any() const noexcept { return bits_ != 0; }
  [[nodiscard]] constexpr bool has(Flag flag) const noexcept { return (bits_ & static_cast<unsigned>(flag)) != 0; }
  /// The sum of the enumerators, as the C interface returns it.
  [[nodiscard]] constexpr std::uint8_t bits() const noexcept { return bits_; }
  /// These flags, and `flag` if `raised`.
  [[nodiscard]] constexpr FlagSet with(Flag flag, bool raised) const noexcept {
    return with(static_cast<std::uint8_t>(raised ? static_cast<unsigned>(flag) : 0u));
  }
  /// These flags, and those of `bits`.
  [[nodiscard]] constexpr FlagSet with(std::uint8_t bits) const noexcept {
    FlagSet result;
    result.bits_ = static_cast<std::uint8_t>(bits_ | bits);
    return result;
  }

 private:
  std::uint8_t bits_ = 0;
};

}  // namespace kphi::compensation
