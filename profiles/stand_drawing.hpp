// Pictures of a stand, its plate and φ: as SVG for report and page, in characters for a terminal.
//
// The SVG takes its colours from the page: lines in currentColor, the plate, the disk and the load cell through CSS
// classes (plate, disk, cell) with colours of their own where no style names them. It holds no script and no link.
#pragma once

#include <string>
#include <vector>

#include "profiles/campaign.hpp"

namespace kphi::profiles {

/// What is drawn of a stand.
struct StandSketch {
  int blades = 2;
  int spin = 0;  ///< +1 counter-clockwise seen from above, -1 clockwise; 0: unknown, no arrow
};

[[nodiscard]] StandSketch sketch_of(const Propeller& propeller, int spin);

/// The stand from the side, with a plate, and what its load cell carries; below it the plates, as draw_plates.
[[nodiscard]] std::string draw_stand(const StandSketch& sketch, const std::vector<double>& occlusions_deg);
/// Each plate from above, the propeller's disk over it; several side by side. Degrees, 0: no plate.
[[nodiscard]] std::string draw_plates(const StandSketch& sketch, const std::vector<double>& occlusions_deg);
/// The same of one plate in characters: '#' the plate, '.' the free part of the disk. Lines without a line end.
[[nodiscard]] std::vector<std::string> plate_in_characters(double occlusion_deg);

}  // namespace kphi::profiles
