#include "profiles/vehicle.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <vector>

#include "compensation/balance.hpp"
#include "compensation/mixing.hpp"
#include "profiles/profile_reader.hpp"

namespace kphi::profiles {
namespace {

/// The keys of the square and the key of any other body exclude each other.
void check_one_body(ProfileReader& file) {
  if (!file.has("/body")) {
    if (file.has("/half_side_m")) return;
    file.refuse("/half_side_m", "missing, and body is missing as well",
                "give half_side_m of a square body, or body with corners_m");
    return;
  }
  for (const char* key : {"/half_side_m", "/hinge_turn_deg", "/arm_mirrored"}) {
    if (!file.has(key)) continue;
    file.refuse(key, "belongs to a square body, but body describes another one", "keep one of the two");
  }
}

/// nullopt, with a finding: not convex.
std::optional<compensation::ConvexPolygon> read_outline(ProfileReader& file, const std::string& pointer) {
  std::vector<compensation::Position> corners;
  for (const auto& [x, y] : file.get<std::vector<std::array<double, 2>>>(pointer))
    corners.push_back({Metres(x), Metres(y)});
  const auto outline = compensation::ConvexPolygon::from(corners.data(), corners.size());
  if (!outline)
    file.refuse(pointer, "not the corners of a convex body in counter-clockwise order",
                "go round once with the body on the left; leave out corners on the line of their neighbours");
  return outline;
}

/// Parts that overlap would count twice.
void read_more_parts(ProfileReader& file, compensation::PolygonBody& body) {
  if (!file.has("/body/more_corners_m")) return;
  std::vector<compensation::ConvexPolygon> parts{body.outline};
  for (std::size_t i = 0; i < file.size("/body/more_corners_m"); ++i) {
    const std::string pointer = fmt::format("/body/more_corners_m/{}", i);
    const auto part = read_outline(file, pointer);
    if (!part) continue;
    if (std::ranges::any_of(parts, [&](const auto& other) { return compensation::overlap(other, *part); }))
      file.refuse(pointer, "overlaps another part of the body, and what lies in both would count twice",
                  "give parts that meet at an edge at most");
    parts.push_back(*part);
    body.more[i] = part;
  }
}

std::optional<compensation::PolygonBody> read_body(ProfileReader& file) {
  const auto outline = read_outline(file, "/body/corners_m");
  if (!outline) return std::nullopt;
  compensation::PolygonBody body{*outline,
                                 Rotors<compensation::Hinge>(file.has("/body/hinges") ? file.size("/body/hinges") : 0)};
  for (std::size_t i = 0; i < body.hinges.size(); ++i) {
    const std::string hinge = fmt::format("/body/hinges/{}", i);
    body.hinges[i] = {{Metres(file.number(hinge + "/x_m")), Metres(file.number(hinge + "/y_m"))},
                      from_degrees(file.number(hinge + "/turn_deg")),
                      file.get_or(hinge + "/mirrored", false)};
  }
  read_more_parts(file, body);
  return body;
}

/// Arms with a hinge and an angle, or hubs.
void check_one_kind_of_arms(ProfileReader& file) {
  constexpr const char* kOfHinges[] = {"/arm_length_m", "/arm_angle_min_deg", "/arm_angle_max_deg"};
  const bool hubs = file.has("/shapes_m");
  if (hubs == file.has("/shapes_deg")) {
    file.refuse(hubs ? "/shapes_m" : "/shapes_deg", hubs ? "given together with shapes_deg" : "missing",
                "give shapes_deg, arm angles of each shape, or shapes_m, the places of its hubs");
    return;
  }
  for (const char* key : kOfHinges) {
    if (hubs == file.has(key))
      file.refuse(key, hubs ? "belongs to arms with hinges, but shapes_m gives their hubs" : "missing",
                  hubs ? "keep one of the two" : "shapes_deg are angles of arms: give their length and range");
  }
  if (file.has("/body") && hubs == file.has("/body/hinges"))
    file.refuse("/body/hinges", hubs ? "belongs to arms with angles, but shapes_m gives their hubs" : "missing",
                hubs ? "keep one of the two" : "give each arm of shapes_deg a hinge");
  for (const char* key : {"/hinge_turn_deg", "/arm_mirrored"}) {
    if (hubs && file.has(key))
      file.refuse(key, "belongs to arms with hinges, but shapes_m gives their hubs", "remove it");
  }
}

/// Of the hinges, of the corners of a square, or of the hubs of the first shape. Throws RefusedFile if a vehicle cannot
/// have so many, or what they are is not clear.
std::size_t count_rotors(ProfileReader& file) {
  std::string pointer = "/body/hinges";
  if (file.has("/shapes_m")) pointer = child_pointer("/shapes_m", file.keys("/shapes_m").front());
  const std::size_t count = file.has(pointer) ? file.size(pointer) : 4;
  if (count > compensation::kMostRotors) {
    file.refuse(pointer, fmt::format("{} rotors are too many", count),
                fmt::format("kphi knows vehicles with {} to {} rotors", compensation::kFewestRotors,
                            compensation::kMostRotors));
  }
  file.throw_findings();
  return count;
}

/// False, with a finding: another number than there are rotors.
bool check_count(ProfileReader& file, const std::string& pointer, std::size_t rotors, const char* noun) {
  const std::size_t count = file.size(pointer);
  if (count == rotors) return true;
  file.refuse(pointer, fmt::format("{} {}, but the vehicle has {} rotors", count, noun, rotors),
              "give one for each, in the same order");
  return false;
}

void check_hinges(ProfileReader& file, const std::array<double, 4>& turns_deg) {
  for (std::size_t i = 1; i < turns_deg.size(); ++i) {
    if (std::ranges::find(turns_deg, turns_deg[i]) != turns_deg.begin() + i)
      file.refuse(fmt::format("/hinge_turn_deg/{}", i), fmt::format("corner {} has an arm already", turns_deg[i]),
                  "give each corner one arm");
  }
}

Rotors<compensation::HubPosition> read_hubs(ProfileReader& file, const std::string& shape, std::size_t rotors) {
  const std::string pointer = child_pointer("/shapes_m", shape);
  Rotors<compensation::HubPosition> hubs;
  for (const auto& [x, y] : file.get<std::vector<std::array<double, 2>>>(pointer)) {
    if (hubs.size() < rotors) hubs.add({Metres(x), Metres(y)});
  }
  (void)check_count(file, pointer, rotors, "hubs");
  return hubs;
}

Rotors<Radians> read_shape(ProfileReader& file, const std::string& shape, std::size_t rotors) {
  const double low = file.number("/arm_angle_min_deg");
  const double high = file.number("/arm_angle_max_deg");
  Rotors<Radians> angles(rotors);
  if (!check_count(file, child_pointer("/shapes_deg", shape), rotors, "angles")) return angles;
  for (std::size_t arm = 0; arm < rotors; ++arm) {
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

void read_arms(ProfileReader& file, std::size_t rotors, Vehicle& vehicle) {
  vehicle.arm_length = Metres(file.number("/arm_length_m"));
  vehicle.arm_angle_min = from_degrees(file.number("/arm_angle_min_deg"));
  vehicle.arm_angle_max = from_degrees(file.number("/arm_angle_max_deg"));
  for (const std::string& shape : file.keys("/shapes_deg")) vehicle.shapes[shape] = read_shape(file, shape, rotors);
  file.require_above("/arm_angle_max_deg", "/arm_angle_min_deg", "", "swap or fix the two");
  // Closer in, an arm's own corner would be covered at every angle, and the closed forms do not hold.
  file.require_above("/arm_length_m", "/propeller_radius_m", " m",
                     "check both; the propeller must clear the hinge of its arm");
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

flight::Build read_dynamics(ProfileReader& file, std::size_t rotors) {
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
  for (const int spin : file.get<std::vector<int>>("/dynamics/rotor_spins")) {
    if (build.spin.size() < rotors) build.spin.add(spin);
  }
  (void)check_count(file, "/dynamics/rotor_spins", rotors, "spins");
  check_body_inertia(file, build);
  if (!(static_cast<double>(rotors) * build.hub_mass_kg < build.mass_kg)) {
    file.refuse("/dynamics/hub_mass_kg",
                fmt::format("{} times {} kg leave nothing of {} kg (mass_kg) for the body", rotors, build.hub_mass_kg,
                            build.mass_kg),
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

/// Whether no difference of thrusts can tilt the vehicle about one axis.
bool on_one_line(const compensation::RotorLayout& layout) {
  Eigen::Matrix2Xd hubs(2, static_cast<Eigen::Index>(layout.hubs.size()));
  for (std::size_t i = 0; i < layout.hubs.size(); ++i)
    hubs.col(static_cast<Eigen::Index>(i)) << layout.hubs[i].x.value(), layout.hubs[i].y.value();
  hubs.colwise() -= hubs.rowwise().mean().eval();
  const Eigen::Matrix2d spread = hubs * hubs.transpose();
  return !(spread.determinant() > 1e-6 * spread.trace() * spread.trace());
}

/// In each shape the rotors must make thrust, roll, pitch and, from four of them on, yaw. One finding for the file.
void check_hold(ProfileReader& file, const Vehicle& vehicle) {
  const flight::Build& build = *vehicle.dynamics;
  for (const std::string& shape : shapes_of(vehicle)) {
    // About which point does not matter here: any force may be balanced by another one.
    const auto layout = layout_of(hubs_of(vehicle, shape), compensation::Masses{1, {}, {}}, build.spin);
    if (compensation::Mixer::build(layout, {Metres(build.yaw_arm_m), 0})) continue;
    if (on_one_line(layout)) {
      file.refuse(child_pointer(vehicle.hubs.empty() ? "/shapes_deg" : "/shapes_m", shape),
                  "the hubs are on one line, so no difference of thrusts tilts the vehicle about it",
                  "no mixer can hold this shape; move a hub off the line, or remove the shape");
    } else {
      file.refuse("/dynamics/rotor_spins",
                  fmt::format("no difference of thrusts turns the vehicle about z in the shape {}", shape),
                  "give half of the rotors 1 and half -1, in a quadrotor neighbours unlike");
    }
    return;
  }
}

}  // namespace

Vehicle parse_vehicle(const std::string& text, const std::string& path) {
  ProfileReader file(text, path, FileKind::vehicle);
  Vehicle vehicle;
  vehicle.name = file.text("/name");
  check_one_body(file);
  check_one_kind_of_arms(file);
  const std::size_t rotors = count_rotors(file);
  vehicle.half_side = Metres(file.get_or("/half_side_m", 0.0));
  if (file.has("/body")) vehicle.body = read_body(file);
  vehicle.propeller_radius = Metres(file.number("/propeller_radius_m"));
  vehicle.hinge_turn_deg = file.get_or("/hinge_turn_deg", std::array<double, 4>{0, 90, 180, 270});
  vehicle.arm_mirrored = file.get_or("/arm_mirrored", vehicle.arm_mirrored);
  vehicle.overlap = compensation::overlap_measure_named(file.get_or("/overlap", std::string("rim_arc"))).value();
  if (file.has("/shapes_deg")) read_arms(file, rotors, vehicle);
  if (file.has("/shapes_m")) {
    for (const std::string& shape : file.keys("/shapes_m")) vehicle.hubs[shape] = read_hubs(file, shape, rotors);
  }
  vehicle.speed_min = from_rpm(file.number("/speed_min_rpm"));
  vehicle.speed_max = from_rpm(file.number("/speed_max_rpm"));
  if (file.has("/dynamics")) vehicle.dynamics = read_dynamics(file, rotors);
  if (file.has("/control")) vehicle.control = read_control(file);
  vehicle.text = text;
  vehicle.path = path;
  file.require_above("/speed_max_rpm", "/speed_min_rpm", "", "swap or fix the two");
  check_hinges(file, vehicle.hinge_turn_deg);
  file.finish();
  if (vehicle.dynamics) check_hold(file, vehicle);
  file.finish();
  return vehicle;
}

std::size_t rotors_of(const Vehicle& vehicle) {
  return vehicle.hubs.empty() ? rotors_of(airframe_of(vehicle)) : vehicle.hubs.begin()->second.size();
}

std::vector<std::string> shapes_of(const Vehicle& vehicle) {
  std::vector<std::string> names;
  for (const auto& [name, unused] : vehicle.shapes) names.push_back(name);
  for (const auto& [name, unused] : vehicle.hubs) names.push_back(name);
  return names;
}

Rotors<compensation::HubPosition> hubs_of(const Vehicle& vehicle, const std::string& shape) {
  if (!vehicle.hubs.empty()) return vehicle.hubs.at(shape);
  const compensation::Airframe airframe = airframe_of(vehicle);
  const Rotors<Radians>& angles = vehicle.shapes.at(shape);
  Rotors<compensation::HubPosition> hubs(angles.size());
  for (std::size_t i = 0; i < angles.size(); ++i) hubs[i] = hub_in_body(airframe, i, angles[i]);
  return hubs;
}

compensation::Airframe airframe_of(const Vehicle& vehicle) {
  compensation::Airframe airframe{vehicle.half_side, vehicle.arm_length, vehicle.propeller_radius, vehicle.speed_min,
                                  vehicle.speed_max};
  for (std::size_t i = 0; i < 4; ++i) airframe.hinge_turns[i] = static_cast<int>(vehicle.hinge_turn_deg[i] / 90.0);
  airframe.mirrored = vehicle.arm_mirrored;
  airframe.overlap = vehicle.overlap;
  airframe.polygon = vehicle.body;
  if (vehicle.hubs.empty()) {
    airframe.arms.from = vehicle.arm_angle_min;
    airframe.arms.to = vehicle.arm_angle_max;
    return airframe;
  }
  // A hinge for each rotor, which nobody asks: the hubs are told.
  if (!vehicle.body) airframe.polygon.emplace(compensation::ConvexPolygon::square(vehicle.half_side));
  airframe.polygon->hinges = Rotors<compensation::Hinge>(rotors_of(vehicle));
  airframe.arm_length = vehicle.propeller_radius;
  return airframe;
}

Vehicle load_vehicle(const std::string& path) { return parse_vehicle(read_text(path), path); }

}  // namespace kphi::profiles
