// How the overlap of a propeller's disk with the body becomes one angle φ. On the bench's sector plates all three
// agree; over a body they differ by tens of degrees, so a line must be flown with the measure it was fitted with.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace kphi::compensation {

enum class OverlapMeasure : std::uint8_t {
  rim_arc,     ///< arc of the rim over the body (the paper's "near the tips")
  area_share,  ///< 2π × share of the disk's area over the body
  load_share,  ///< 2π × share over the body of a disk whose thrust per ring grows like r² dr
};

struct OverlapMeasureName {
  OverlapMeasure measure;
  std::string_view name;  ///< as in coefficient and vehicle files
};
inline constexpr std::array<OverlapMeasureName, 3> kOverlapMeasureNames{{{OverlapMeasure::rim_arc, "rim_arc"},
                                                                         {OverlapMeasure::area_share, "area_share"},
                                                                         {OverlapMeasure::load_share, "load_share"}}};

/// "unknown" for a value that is none of the three.
[[nodiscard]] constexpr std::string_view name_of(OverlapMeasure measure) noexcept {
  for (const OverlapMeasureName& entry : kOverlapMeasureNames) {
    if (entry.measure == measure) return entry.name;
  }
  return "unknown";
}

[[nodiscard]] constexpr std::optional<OverlapMeasure> overlap_measure_named(std::string_view name) noexcept {
  for (const OverlapMeasureName& entry : kOverlapMeasureNames) {
    if (entry.name == name) return entry.measure;
  }
  return std::nullopt;
}

}  // namespace kphi::compensation
