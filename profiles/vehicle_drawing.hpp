// A vehicle from above in each of its shapes: body, arms, disks, and what of each disk the body covers.
#pragma once

#include <string>
#include <vector>

#include "compensation/units.hpp"
#include "profiles/vehicle.hpp"

namespace kphi::profiles {

/// φ of each rotor in a shape that it has, as in flight.
[[nodiscard]] std::vector<Radians> occlusions_of(const Vehicle& vehicle, const std::string& shape);

/// All shapes, two in a row so that a telephone shows their words, the nose up; each disk with its number and φ, and
/// its sense where the file tells it. Colours as in stand_drawing; no script, no link.
[[nodiscard]] std::string draw_shapes(const Vehicle& vehicle);

/// The same in characters, two shapes side by side, 78 columns, below a line that says so: '#' a covered part of a
/// disk,
/// '.' a free one, ':' the body, a hub by its number. Lines without a line end.
[[nodiscard]] std::vector<std::string> shapes_in_characters(const Vehicle& vehicle);

}  // namespace kphi::profiles
