#include "compensation/flight/shadow.hpp"

#include <Eigen/Core>

namespace kphi::flight {
namespace {

using compensation::ConvexPolygon;

constexpr int kRings = 32;
constexpr std::size_t kTableSize = 2048;  // over one turn, from -π

Eigen::Vector2d corner(const ConvexPolygon& outline, std::size_t i) noexcept {
  const compensation::Position& at = outline.corner(i % outline.size());
  return {at.x.value(), at.y.value()};
}

bool lies_inside(const ConvexPolygon& outline, const Eigen::Vector2d& point) noexcept {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d edge = corner(outline, i + 1) - corner(outline, i), to = point - corner(outline, i);
    if (!(edge.x() * to.y() - edge.y() * to.x() > 0)) return false;
  }
  return true;
}

}  // namespace

double covered_arc(const ConvexPolygon& outline, double radius, double x, double y) {
  const Eigen::Vector2d hub(x, y);
  std::array<double, 2 * ConvexPolygon::kMaxCorners + 2>
      crossings{};  // each edge's line meets the circle twice at most
  std::size_t count = 0;
  const auto note = [&](const Eigen::Vector2d& from_hub) {
    const double angle = std::atan2(from_hub.y(), from_hub.x());
    crossings[count++] = angle < 0 ? angle + 2 * kPi : angle;
  };
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d from = corner(outline, i) - hub, along = (corner(outline, i + 1) - hub - from).normalized();
    if (along.x() * from.y() - along.y() * from.x() >= radius) return 0;  // the circle lies beyond this edge
    const Eigen::Vector2d foot = from - from.dot(along) * along;
    const double half_chord_squared = radius * radius - foot.squaredNorm();
    if (!(half_chord_squared > 0)) continue;
    note(foot + std::sqrt(half_chord_squared) * along);
    note(foot - std::sqrt(half_chord_squared) * along);
  }
  crossings[count++] = 0;
  crossings[count++] = 2 * kPi;
  std::sort(crossings.begin(), crossings.begin() + static_cast<std::ptrdiff_t>(count));
  double covered = 0;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    const double middle = (crossings[i] + crossings[i + 1]) / 2;
    const Eigen::Vector2d rim = hub + radius * Eigen::Vector2d(std::cos(middle), std::sin(middle));
    if (lies_inside(outline, rim)) covered += crossings[i + 1] - crossings[i];
  }
  return covered;
}

double covered_load(const ConvexPolygon& outline, double radius, double x, double y) {
  double covered = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double share = (ring + 0.5) / kRings;
    covered += 3 * share * share * covered_arc(outline, share * radius, x, y) / kRings;
  }
  return covered;
}

Shadow::Shadow(const Vehicle& vehicle) : arc_(vehicle.rotors()), load_(vehicle.rotors()) {
  const double radius = vehicle.airframe.propeller_radius.value();
  for (std::size_t arm = 0; arm < vehicle.rotors(); ++arm) {
    for (std::size_t i = 0; i <= kTableSize; ++i) {
      const Radians angle(2 * kPi * static_cast<double>(i) / kTableSize - kPi);
      const auto hub = hub_of(vehicle, arm, angle);
      double arc = 0, load = 0;
      for_each_part(vehicle.airframe, [&](const ConvexPolygon& part) {
        arc += covered_arc(part, radius, hub.x.value(), hub.y.value());
        load += covered_load(part, radius, hub.x.value(), hub.y.value());
      });
      arc_[arm].push_back(arc);
      load_[arm].push_back(load);
    }
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
