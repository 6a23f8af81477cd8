#include "profiles/world.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "profiles/profile_reader.hpp"

namespace kphi::profiles {
namespace {

flight::LossLaw law_named(const std::string& name) {
  for (int i = 0; i < flight::kLossLaws; ++i) {
    if (name == name_of(static_cast<flight::LossLaw>(i))) return static_cast<flight::LossLaw>(i);
  }
  return flight::LossLaw::quadratic;  // the schema knows no other
}

std::array<int, 4> read_wiring(ProfileReader& file) {
  auto wiring = file.get_or("/arm_wiring", std::array<int, 4>{1, 2, 3, 4});
  for (std::size_t i = 1; i < wiring.size(); ++i) {
    if (std::ranges::find(wiring, wiring[i]) == wiring.begin() + i) continue;
    file.refuse(fmt::format("/arm_wiring/{}", i), fmt::format("arm {} is named twice", wiring[i]),
                "name each arm once");
  }
  for (int& arm : wiring) --arm;
  return wiring;
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
  truth.thrust = file.get_or("/rotor_thrust_share", truth.thrust);
  const auto cog = file.get_or("/cog_error_mm", std::array<double, 2>{});
  truth.cog_error = 1e-3 * Eigen::Vector2d(cog[0], cog[1]);
  const auto errors = file.get_or("/arm_error_deg", std::array<double, 4>{});
  for (std::size_t i = 0; i < errors.size(); ++i) truth.arm_error[i] = from_degrees(errors[i]).value();
  truth.arms = {file.get_or("/servo_lag_s", 0.0), from_degrees(file.get_or("/servo_backlash_deg", 0.0)).value(),
                file.get_or("/arm_feedback_delay_s", 0.0)};
  truth.estimate_delay_s = file.get_or("/estimate_delay_s", 0.0);
  truth.gyro_delay_s = file.get_or("/gyro_delay_s", 0.0);
  truth.motor_noise = file.get_or("/motor_noise_share", 0.0);
  truth.wiring = read_wiring(file);
  world.drag = file.has("/air_drag_per_s");
  truth.drag = file.get_or("/air_drag_per_s", 0.0);
  const auto wind = file.get_or("/wind_m_s", std::array<double, 3>{});
  truth.wind = Eigen::Vector3d(wind.data());
  file.finish();
  return world;
}

World load_world(const std::string& path) { return parse_world(read_text(path), path); }

}  // namespace kphi::profiles
