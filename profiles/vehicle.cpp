#include "profiles/vehicle.hpp"

#include <fmt/format.h>

#include <vector>

#include "profiles/profile_reader.hpp"

namespace kphi::profiles {
namespace {

void check_order(ProfileReader& file, const char* low, const char* high) {
  if (file.number(low) < file.number(high)) return;
  file.refuse(high, fmt::format("{} is not above {} ({})", file.number(high), file.number(low), dotted(low)),
              "swap or mend the two");
}

/// Closer in, an arm's own corner would be covered at every angle, and the closed forms do not hold.
void check_arm_length(ProfileReader& file) {
  const double arm = file.number("/arm_length_m");
  const double radius = file.number("/propeller_radius_m");
  if (arm > radius) return;
  file.refuse("/arm_length_m", fmt::format("{} is not above {} m (propeller_radius_m)", arm, radius),
              "check both; the propeller must clear the hinge of its arm");
}

/// The keys of the square and the key of any other body exclude each other.
void check_one_body(ProfileReader& file) {
  if (!file.has("/body")) {
    if (file.has("/half_side_m")) return;
    file.refuse("/half_side_m", "missing, and there is no body either",
                "give half_side_m of a square body, or body with corners_m and hinges");
    return;
  }
  for (const char* key : {"/half_side_m", "/hinge_turn_deg", "/arm_mirrored"}) {
    if (!file.has(key)) continue;
    file.refuse(key, "belongs to a square body, but body gives another one", "keep one of the two");
  }
}

std::optional<compensation::PolygonBody> read_body(ProfileReader& file) {
  std::vector<compensation::Position> corners;
  for (const auto& corner : file.get<std::vector<std::array<double, 2>>>("/body/corners_m")) {
    corners.push_back({Metres(corner[0]), Metres(corner[1])});
  }
  const auto outline = compensation::ConvexPolygon::from(corners.data(), corners.size());
  if (!outline) {
    file.refuse("/body/corners_m", "not the corners of a convex body in counter-clockwise order",
                "go round once with the body on the left; leave out corners on the line of their neighbours");
    return std::nullopt;
  }
  compensation::PolygonBody body{*outline, {}};
  for (std::size_t i = 0; i < body.hinges.size(); ++i) {
    const std::string hinge = fmt::format("/body/hinges/{}", i);
    body.hinges[i] = {{Metres(file.number(hinge + "/x_m")), Metres(file.number(hinge + "/y_m"))},
                      from_degrees(file.number(hinge + "/turn_deg")),
                      file.get_or(hinge + "/mirrored", false)};
  }
  return body;
}

void check_hinges(ProfileReader& file, const std::array<double, 4>& turns_deg) {
  for (std::size_t i = 1; i < turns_deg.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (turns_deg[i] != turns_deg[j]) continue;
      file.refuse(fmt::format("/hinge_turn_deg/{}", i), fmt::format("corner {} has an arm already", turns_deg[i]),
                  "give each corner one arm");
    }
  }
}

std::array<Radians, 4> read_shape(ProfileReader& file, const std::string& shape) {
  const double low = file.number("/arm_angle_min_deg");
  const double high = file.number("/arm_angle_max_deg");
  std::array<Radians, 4> angles;
  for (std::size_t arm = 0; arm < angles.size(); ++arm) {
    const std::string pointer = child_pointer(child_pointer("/shapes_deg", shape), std::to_string(arm));
    const double angle = file.number(pointer);
    angles[arm] = from_degrees(angle);
    if (angle >= low && angle <= high) continue;
    file.refuse(pointer,
                fmt::format("{} is outside {} to {} degrees (arm_angle_min_deg, arm_angle_max_deg)", angle, low, high),
                "the servo cannot go there; mend the angle or the range");
  }
  return angles;
}

}  // namespace

Vehicle parse_vehicle(const std::string& text, const std::string& path) {
  ProfileReader file(text, path, FileKind::vehicle);
  Vehicle vehicle;
  vehicle.name = file.text("/name");
  check_one_body(file);
  vehicle.half_side = Metres(file.get_or("/half_side_m", 0.0));
  if (file.has("/body")) vehicle.body = read_body(file);
  vehicle.arm_length = Metres(file.number("/arm_length_m"));
  vehicle.propeller_radius = Metres(file.number("/propeller_radius_m"));
  vehicle.hinge_turn_deg = file.get_or("/hinge_turn_deg", std::array<double, 4>{0, 90, 180, 270});
  vehicle.arm_mirrored = file.get_or("/arm_mirrored", vehicle.arm_mirrored);
  vehicle.overlap = compensation::overlap_measure_named(file.get_or("/overlap", std::string("rim_arc"))).value();
  for (const std::string& shape : file.keys("/shapes_deg")) vehicle.shapes[shape] = read_shape(file, shape);
  vehicle.arm_angle_min = from_degrees(file.number("/arm_angle_min_deg"));
  vehicle.arm_angle_max = from_degrees(file.number("/arm_angle_max_deg"));
  vehicle.speed_min = from_rpm(file.number("/speed_min_rpm"));
  vehicle.speed_max = from_rpm(file.number("/speed_max_rpm"));
  vehicle.text = text;
  vehicle.path = path;
  check_order(file, "/arm_angle_min_deg", "/arm_angle_max_deg");
  check_order(file, "/speed_min_rpm", "/speed_max_rpm");
  check_arm_length(file);
  check_hinges(file, vehicle.hinge_turn_deg);
  file.finish();
  return vehicle;
}

compensation::Airframe airframe_of(const Vehicle& vehicle) {
  compensation::Airframe airframe{vehicle.half_side, vehicle.arm_length, vehicle.propeller_radius, vehicle.speed_min,
                                  vehicle.speed_max};
  for (std::size_t i = 0; i < 4; ++i) airframe.hinge_turns[i] = static_cast<int>(vehicle.hinge_turn_deg[i] / 90.0);
  airframe.mirrored = vehicle.arm_mirrored;
  airframe.overlap = vehicle.overlap;
  airframe.polygon = vehicle.body;
  return airframe;
}

Vehicle load_vehicle(const std::string& path) { return parse_vehicle(read_text(path), path); }

}  // namespace kphi::profiles
