// Whether numbers come from devices or from a simulator: no output of kphi loses it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace kphi {

enum class Origin : std::uint8_t { unknown, measured, simulated };
inline constexpr std::array<const char*, 3> kOriginNames{"unknown", "measured", "simulated"};
[[nodiscard]] constexpr const char* name_of(Origin origin) { return kOriginNames[static_cast<std::size_t>(origin)]; }
/// Of that name; unknown for any other.
[[nodiscard]] constexpr Origin origin_named(std::string_view name) {
  for (const Origin origin : {Origin::measured, Origin::simulated})
    if (name == name_of(origin)) return origin;
  return Origin::unknown;
}

/// Of several: simulated if one is, measured if all are.
[[nodiscard]] constexpr Origin together(Origin one, Origin other) {
  if (one == Origin::simulated || other == Origin::simulated) return Origin::simulated;
  return one == other ? one : Origin::unknown;
}

}  // namespace kphi
