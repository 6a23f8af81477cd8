// The box's unit codes, their spellings, and its counts per unit. Manual, TCP interface; counts: 1 000 000 for N and 1
// for lbf were seen on one box, the rest follows the same pattern: SI in millionths, customary units in whole ones.
#pragma once

#include <array>
#include <string_view>

namespace kphi::sim {

struct Unit {
  std::string_view name;
  double si;   ///< SI units in one of these
  int counts;  ///< per unit
};

inline constexpr std::array<Unit, 6> kForceUnits{{{"lbf", 4.4482216152605, 1},
                                                  {"N", 1, 1'000'000},
                                                  {"klbf", 4448.2216152605, 1},
                                                  {"kN", 1000, 1'000'000},
                                                  {"kgf", 9.80665, 1},
                                                  {"gf", 0.00980665, 1}}};
inline constexpr std::array<Unit, 6> kTorqueUnits{{{"lbf-in", 0.1129848290276167, 1},
                                                   {"lbf-ft", 1.3558179483314004, 1},
                                                   {"Nm", 1, 1'000'000},
                                                   {"Nmm", 0.001, 1000},
                                                   {"kgf-cm", 0.0980665, 1},
                                                   {"kNm", 1000, 1'000'000}}};
inline constexpr std::array<Unit, 5> kDistanceUnits{
    {{"in", 0.0254, 0}, {"ft", 0.3048, 0}, {"mm", 0.001, 0}, {"cm", 0.01, 0}, {"m", 1, 0}}};
inline constexpr std::array<Unit, 2> kAngleUnits{{{"degrees", 0.017453292519943295, 0}, {"radians", 1, 0}}};

/// Codes count from 1.
template <std::size_t N>
[[nodiscard]] constexpr const Unit& unit(const std::array<Unit, N>& units, int code) noexcept {
  return units[static_cast<std::size_t>(code - 1)];
}

}  // namespace kphi::sim
