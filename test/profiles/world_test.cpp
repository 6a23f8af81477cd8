#include "profiles/world.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"
#include "profiles/strict_yaml.hpp"
#include "test/profiles/refusals.hpp"
#include "test/source_dir.hpp"

namespace kphi::profiles {
namespace world_test {

using testing::HasSubstr;

constexpr const char* kWorldText =
    "format: kphi-world/1\n"
    "name: thin_air\n"
    "k_t_n_per_rpm2: 1.5e-8\n"
    "loss_law: steep_onset\n"
    "gamma: 1.2\n";

std::string complaint(const std::string& text) {
  try {
    (void)parse_world(text, "w.yaml");
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(World, WithoutMoreHasNoErrorsAndTheDragOfTheVehicle) {
  const World world = parse_world(kWorldText, "w.yaml");
  EXPECT_NEAR(to_newtons_per_rpm2(world.truth.thrust_coefficient), 1.5e-8, 1e-20);
  EXPECT_EQ(world.truth.law, flight::LossLaw::steep_onset);
  EXPECT_EQ(world.truth.gamma, 1.2);
  EXPECT_EQ(world.truth.mass, 1);
  EXPECT_EQ(world.truth.cog_error.norm(), 0);
  EXPECT_FALSE(world.truth.wired_crosswise());
  EXPECT_FALSE(world.drag);
}

TEST(World, ReadsAllThatTheExampleShows) {
  const World world = load_world(test::source_dir() + "/profiles/world_example.yaml");
  EXPECT_EQ(world.truth.thrust[1], 0.99);
  EXPECT_EQ(world.truth.cog_error, Eigen::Vector2d(1e-3, -0.5e-3));
  EXPECT_EQ(world.truth.arms.lag_s, 0.03);
  EXPECT_NEAR(world.truth.arms.backlash, 0.5 * kPi / 180, 1e-15);
  EXPECT_EQ(world.truth.arms.feedback_delay_s, 0.02);
  EXPECT_EQ(world.truth.estimate_delay_s, 0.02);
}

TEST(World, IsOfAVehicleWithAsManyRotorsAndOfArmsThatHaveAngles) {
  const auto complaint_of = [](const std::string& line, const char* vehicle) -> std::string {
    try {
      require_vehicle(parse_world(std::string(kWorldText) + line + "\n", "w.yaml"), load_vehicle(shipped(vehicle)));
    } catch (const ConfigurationError& refused) {
      return refused.what();
    }
    return "";
  };
  const std::string shares = "rotor_thrust_share: [1, 1, 0.9, 1]";
  EXPECT_EQ(complaint_of(shares, "foldable_drone.yaml"), "");
  EXPECT_EQ(complaint_of("", "foldable_hexa.yaml"), "");
  EXPECT_THAT(complaint_of(shares, "foldable_hexa.yaml"), HasSubstr("w.yaml: its lists are of 4 rotors, but"));
  EXPECT_EQ(complaint_of("arm_error_deg: [0, 0, 0, 0]", "telescoping_quad.yaml"), "");
  EXPECT_THAT(complaint_of("arm_error_deg: [0, 0, 1, 0]", "telescoping_quad.yaml"), HasSubstr("shapes_m"));
}

TEST(World, RefusesInOneLineWithItsPlace) {
  const auto with = [](const std::string& line) { return complaint(std::string(kWorldText) + line + "\n"); };
  EXPECT_THAT(with("arm_wiring: [1, 2, 2, 4]"), HasSubstr("w.yaml:6:20: arm_wiring[2]: arm 2 is named twice"));
  EXPECT_THAT(with("arm_wiring: [1, 2, 3, 5]"), HasSubstr("6:23: arm_wiring[3]: there is no arm 5 among 4"));
  EXPECT_THAT(with("arm_wiring: [1, 2, 3, 4]\narm_error_deg: [0, 0, 0, 0, 0, 0]"),
              HasSubstr("arm_wiring: 4 values, but another list has 6; give one for each rotor"));
  EXPECT_THAT(with("servo_lag_s: -1"), HasSubstr("6:14: servo_lag_s"));
  EXPECT_THAT(with("servo_lag_ms: 30"), HasSubstr("servo_lag_ms is not a key"));
  EXPECT_THAT(complaint("format: kphi-vehicle/1\n"), HasSubstr("expected a world file"));
  EXPECT_THAT(complaint("format: kphi-world/1\nname: a\n"), HasSubstr("k_t_n_per_rpm2"));
}

}  // namespace world_test
}  // namespace kphi::profiles
