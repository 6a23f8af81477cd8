// The parameters of a curve that is a line.
#pragma once

#include "compensation/thrust_curve.hpp"

namespace kphi::compensation {

inline Line line_of(const ThrustCurve& curve) {
  return curve.visit([](const Line& line) { return line; }, [](const OcclusionTable&) { return Line{}; });
}

}  // namespace kphi::compensation
