#include "profiles/vehicle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "profiles/profile_reader.hpp"

namespace kphi::profiles {
namespace {

/// The keys of the square and the key of any other body exclude each other.
void check_one_body(ProfileReader& file) {
  if (!file.has("/body")) {
    if (file.has("/half_side_m")) return;
    file.refuse("/half_side_m", "missing, and body is missing as well",
                "give half_side_m of a square body, or body with corners_m and hinges");
    return;
  }
  for (const char* key : {"/half_side_m", "/hinge_turn_deg", "/arm_mirrored"}) {
    if (!file.has(key)) continue;
    file.refuse(key, "belongs to a square body, but body describes another one", "keep one of the two");
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
  compensation::PolygonBody body{*outline, compensation::Rotors<compensation::Hinge>(4)};
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
    if (std::ranges::find(turns_deg, turns_deg[i]) != turns_deg.begin() + i)
      file.refuse(fmt::format("/hinge_turn_deg/{}", i), fmt::format("corner {} has an arm already", turns_deg[i]),
                  "give each corner one arm");
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
                "the servo cannot go there; fix the angle or the range");
  }
  return angles;
}

Eigen::Vector3d read_vector(const ProfileReader& file, const std::string& pointer) {
  return Eigen::Vector3d(file.get<std::array<double, 3>>(pointer).data());
}

/// A plate's inertia follows from its height; any other body's is given by three numbers.
void check_body_inertia(ProfileReader& file, const flight::Build& build) {
  const bool plate = file.has("/dynamics/body_height_m");
  if (plate == build.body_inertia.has_value()) {
    file.refuse(plate ? "/dynamics/body_inertia_kg_m2" : "/dynamics",
                plate ? "given together with body_height_m" : "neither body_height_m nor body_inertia_kg_m2",
                "give one of the two: the height of a body that is a plate, or its moments of inertia");
  }
  if (!build.body_inertia) return;
  const Eigen::Vector3d& j = *build.body_inertia;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (j[i] <= j[(i + 1) % 3] + j[(i + 2) % 3]) continue;
    file.refuse(fmt::format("/dynamics/body_inertia_kg_m2/{}", i),
                fmt::format("{} is more than the other two together, which no body has", j[i]),
                "check the three moments of inertia [kg m2]");
  }
}

flight::Build read_dynamics(ProfileReader& file) {
  const auto number = [&](const char* key) { return file.number(std::string("/dynamics/") + key); };
  flight::Build build;
  build.mass_kg = number("mass_kg");
  build.hub_mass_kg = number("hub_mass_kg");
  build.body_height_m = file.get_or("/dynamics/body_height_m", 0.0);
  if (file.has("/dynamics/body_inertia_kg_m2")) build.body_inertia = read_vector(file, "/dynamics/body_inertia_kg_m2");
  build.yaw_arm_m = number("drag_torque_per_thrust_m");
  build.rotor_lag_s = number("rotor_lag_s");
  build.air_drag_per_s = number("air_drag_per_s");
  build.morph_s = number("morph_s");
  build.spin = file.get<std::array<double, 4>>("/dynamics/rotor_spins");
  check_body_inertia(file, build);
  if (!(4 * build.hub_mass_kg < build.mass_kg)) {
    file.refuse(
        "/dynamics/hub_mass_kg",
        fmt::format("four times {} kg leave nothing of {} kg (mass_kg) for the body", build.hub_mass_kg, build.mass_kg),
        "mass_kg is the mass of the whole vehicle, hub_mass_kg of one arm's end");
  }
  return build;
}

flight::PilotSettings read_control(const ProfileReader& file) {
  const auto vector = [&](const char* key) { return read_vector(file, std::string("/control/") + key); };
  flight::PilotSettings pilot;
  pilot.gains = {vector("position_gain_per_s2"),        vector("velocity_gain_per_s"),
                 vector("attitude_gain_per_s"),         vector("rate_gain_per_s"),
                 file.number("/control/torque_weight"), vector("position_error_max_m"),
                 vector("velocity_error_max_m_s"),      file.number("/control/collective_min_m_s2")};
  pilot.assured_yaw = file.number("/control/assured_yaw_nm");
  return pilot;
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
  if (file.has("/dynamics")) vehicle.dynamics = read_dynamics(file);
  if (file.has("/control")) vehicle.control = read_control(file);
  vehicle.text = text;
  vehicle.path = path;
  file.require_above("/arm_angle_max_deg", "/arm_angle_min_deg", "", "swap or fix the two");
  file.require_above("/speed_max_rpm", "/speed_min_rpm", "", "swap or fix the two");
  // Closer in, an arm's own corner would be covered at every angle, and the closed forms do not hold.
  file.require_above("/arm_length_m", "/propeller_radius_m", " m",
                     "check both; the propeller must clear the hinge of its arm");
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
  airframe.arms.from = vehicle.arm_angle_min;
  airframe.arms.to = vehicle.arm_angle_max;
  return airframe;
}

Vehicle load_vehicle(const std::string& path) { return parse_vehicle(read_text(path), path); }

}  // namespace kphi::profiles
