#include "compensation/flight/shadow.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace kphi::flight {
namespace {

constexpr int kRings = 32;
constexpr std::size_t kTableSize = 2048;  // over one turn, from -π

}  // namespace

double covered_arc(double half_side, double radius, double x, double y) {
  std::array<double, 10> crossings{};  // each edge's line meets the circle twice at most
  std::size_t count = 0;
  const auto note = [&](double dx, double dy) {
    double angle = std::atan2(dy, dx);
    if (angle < 0) angle += 2 * kPi;
    crossings[count++] = angle;
  };
  for (const double edge : {-half_side, half_side}) {
    const double across_x = edge - x, across_y = edge - y;
    const double along_x = radius * radius - across_x * across_x, along_y = radius * radius - across_y * across_y;
    if (along_x > 0) {
      note(across_x, std::sqrt(along_x));
      note(across_x, -std::sqrt(along_x));
    }
    if (along_y > 0) {
      note(std::sqrt(along_y), across_y);
      note(-std::sqrt(along_y), across_y);
    }
  }
  crossings[count++] = 0;
  crossings[count++] = 2 * kPi;
  std::sort(crossings.begin(), crossings.begin() + static_cast<std::ptrdiff_t>(count));
  double covered = 0;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    const double middle = (crossings[i] + crossings[i + 1]) / 2;
    const bool inside =
        std::fabs(x + radius * std::cos(middle)) < half_side && std::fabs(y + radius * std::sin(middle)) < half_side;
    if (inside) covered += crossings[i + 1] - crossings[i];
  }
  return covered;
}

double covered_load(double half_side, double radius, double x, double y) {
  double covered = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double share = (ring + 0.5) / kRings;
    covered += 3 * share * share * covered_arc(half_side, share * radius, x, y) / kRings;
  }
  return covered;
}

Shadow::Shadow(const compensation::Airframe& airframe) : arc_(kTableSize + 1), load_(kTableSize + 1) {
  const double a = airframe.half_side.value(), radius = airframe.propeller_radius.value();
  for (std::size_t i = 0; i <= kTableSize; ++i) {
    const Radians angle(2 * kPi * static_cast<double>(i) / kTableSize - kPi);
    const auto hub = hub_seen_from_hinge(airframe, angle);
    arc_[i] = covered_arc(a, radius, hub.x.value(), hub.y.value());
    load_[i] = covered_load(a, radius, hub.x.value(), hub.y.value());
  }
}

double Shadow::at(const std::vector<double>& table, double angle) noexcept {
  const double turn = 2 * kPi;
  const double place = (angle + kPi - turn * std::floor((angle + kPi) / turn)) / turn * kTableSize;
  const std::size_t below = std::min(static_cast<std::size_t>(place), kTableSize - 1);
  const double share = place - static_cast<double>(below);
  return (1 - share) * table[below] + share * table[below + 1];
}

}  // namespace kphi::flight
