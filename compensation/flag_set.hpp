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
  [[nodiscard]] constexpr std::uint16_t bits() const noexcept { return bits_; }
  /// These flags, with this one as `raised` says.
#ifdef __GNUC__
  [[gnu::always_inline]]  // three instructions, and as many of a call at every rotor
#endif
  [[nodiscard]] constexpr FlagSet
  with(Flag flag, bool raised) const noexcept {
    const auto bit = static_cast<unsigned>(flag);
    FlagSet result;
    result.bits_ = static_cast<std::uint16_t>(raised ? bits_ | bit : bits_ & ~bit);
    return result;
  }

 private:
  std::uint16_t bits_ = 0;
};

}  // namespace kphi::compensation
