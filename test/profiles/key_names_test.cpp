#include "profiles/key_names.hpp"

#include <gtest/gtest.h>

namespace kphi::profiles {
namespace {

const std::vector<std::string> kKeys{"steps", "dwell_s", "first_rpm", "last_rpm"};

TEST(KeyNames, EndWithTheirUnit) {
  EXPECT_EQ(split_unit("dwell_s").unit, "s");
  EXPECT_EQ(split_unit("dwell_ms").stem, "dwell");
  EXPECT_EQ(split_unit("speed_rad_s").stem, "speed");
  EXPECT_EQ(split_unit("coil_temperature_max_degc").unit, "°C");
  EXPECT_EQ(split_unit("steps").unit, "");
  EXPECT_EQ(split_unit("_s").stem, "_s") << "a unit alone is no key with a unit";
}

TEST(KeyNames, AreFoundAgainAfterSlipsOfTheFinger) {
  EXPECT_EQ(nearest_name("stesp", kKeys), "steps");
  EXPECT_EQ(nearest_name("step", kKeys), "steps");
  EXPECT_EQ(nearest_name("frist_rpm", kKeys), "first_rpm");
  EXPECT_EQ(nearest_name("las_rmp", kKeys), "last_rpm");
}

TEST(KeyNames, AreNotGuessedFromAfar) {
  EXPECT_FALSE(nearest_name("thrust_max_n", kKeys));
  EXPECT_FALSE(nearest_name("x", kKeys));
  EXPECT_FALSE(nearest_name("", kKeys));
  EXPECT_FALSE(nearest_name("steps", {}));
}

TEST(KeyNames, WithAnotherUnitOrNoneAreRecognised) {
  EXPECT_EQ(same_but_for_unit("dwell_ms", kKeys), "dwell_s");
  EXPECT_EQ(same_but_for_unit("dwell", kKeys), "dwell_s");
  EXPECT_EQ(same_but_for_unit("last_rad_s", kKeys), "last_rpm");
  EXPECT_EQ(same_but_for_unit("steps_n", kKeys), "steps");
  EXPECT_FALSE(same_but_for_unit("dwel_ms", kKeys));
}

}  // namespace
}  // namespace kphi::profiles
