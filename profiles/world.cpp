#include "profiles/world.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "base/error.hpp"
#include "profiles/profile_reader.hpp"

namespace kphi::profiles {
namespace {

flight::LossLaw law_named(const std::string& name) {
  for (int i = 0; i < flight::kLossLaws; ++i) {
    if (name == name_of(static_cast<flight::LossLaw>(i))) return static_cast<flight::LossLaw>(i);
  }
  return flight::LossLaw::quadratic;  // the schema knows no other
}

/// Of each rotor into the first of `to`; the others keep their value.
template <class T, class From>
void read_each(ProfileReader& file, const char* key, World& world, Rotors<T>& to, const From& from) {
  if (!file.has(key)) return;
  const auto values = file.get<std::vector<double>>(key);
  if (world.rotors == 0) world.rotors = values.size();
  if (values.size() != world.rotors) {
    file.refuse(key, fmt::format("{} values, but another list has {}", values.size(), world.rotors),
                "give one for each rotor of the vehicle in all lists");
  }
  for (std::size_t i = 0; i < values.size(); ++i) to[i] = from(values[i]);
}

void check_wiring(ProfileReader& file, const Rotors<std::size_t>& wiring, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::string pointer = fmt::format("/arm_wiring/{}", i);
    if (wiring[i] >= count)
      file.refuse(pointer, fmt::format("there is no arm {} among {}", wiring[i] + 1, count), "name each arm once");
    else if (std::find(wiring.begin(), wiring.begin() + i, wiring[i]) != wiring.begin() + i)
      file.refuse(pointer, fmt::format("arm {} is named twice", wiring[i] + 1), "name each arm once");
  }
}

}  // namespace

World parse_world(const std::string& text, const std::string& path) {
  ProfileReader file(text, path, FileKind::world);
  World world;
  world.name = file.text("/name");
  world.path = path;
  flight::Truth& truth = world.truth;
  truth.thrust_coefficient = from_newtons_per_rpm2(file.number("/k_t_n_per_rpm2"));
  truth.law = law_named(file.text("/loss_law"));
  truth.gamma = file.number("/gamma");
  truth.mass = file.get_or("/mass_share", 1.0);
  read_each(file, "/rotor_thrust_share", world, truth.thrust, [](double share) { return share; });
  const auto cog = file.get_or("/cog_error_mm", std::array<double, 2>{});
  truth.cog_error = 1e-3 * Eigen::Vector2d(cog[0], cog[1]);
  read_each(file, "/arm_error_deg", world, truth.arm_error, [](double off) { return from_degrees(off).value(); });
  truth.arms = {file.get_or("/servo_lag_s", 0.0), from_degrees(file.get_or("/servo_backlash_deg", 0.0)).value(),
                file.get_or("/arm_feedback_delay_s", 0.0)};
  truth.estimate_delay_s = file.get_or("/estimate_delay_s", 0.0);
  truth.gyro_delay_s = file.get_or("/gyro_delay_s", 0.0);
  truth.motor_noise = file.get_or("/motor_noise_share", 0.0);
  read_each(file, "/arm_wiring", world, truth.wiring, [](double arm) { return static_cast<std::size_t>(arm) - 1; });
  if (file.has("/arm_wiring")) check_wiring(file, truth.wiring, file.size("/arm_wiring"));
  world.drag = file.has("/air_drag_per_s");
  truth.drag = file.get_or("/air_drag_per_s", 0.0);
  const auto wind = file.get_or("/wind_m_s", std::array<double, 3>{});
  truth.wind = Eigen::Vector3d(wind.data());
  file.finish();
  return world;
}

void require_vehicle(const World& world, const Vehicle& vehicle) {
  const std::size_t rotors = rotors_of(vehicle);
  if (world.rotors != 0 && world.rotors != rotors)
    throw ConfigurationError(fmt::format("{}: its lists are of {} rotors, but {} has {}; give one value for each",
                                         world.path, world.rotors, vehicle.path, rotors));
  const auto& errors = world.truth.arm_error;
  const bool of_arms =
      world.truth.arms.backlash > 0 || std::ranges::any_of(errors, [](double off) { return off != 0; });
  if (of_arms && !vehicle.hubs.empty())
    throw ConfigurationError(
        fmt::format("{}: arm_error_deg and servo_backlash_deg are angles of arms, but {} has the places of its hubs "
                    "(shapes_m); leave them out",
                    world.path, vehicle.path));
}

World load_world(const std::string& path) { return parse_world(read_text(path), path); }

}  // namespace kphi::profiles
