// The library on a microcontroller: compiled in float for a Cortex-M4F and an M7, and its instructions counted under
// qemu.
#include <gmock/gmock.h>

#include "test/compensation/arm/on_board.hpp"

namespace kphi::test {

void PrintTo(const Processor& processor, std::ostream* out) { *out << processor.name; }

namespace arm_test {

class OnArm : public testing::TestWithParam<Processor> {
 protected:
  void SetUp() override {
    if (const std::string missing = missing_for_boards(); !missing.empty()) GTEST_SKIP() << missing;
  }
};

TEST_P(OnArm, CallsTakeAsManyInstructionsAsPromised) {
  auto counts = OnBoard(GetParam(), "Release").counts();
  for (const auto& [name, count] : counts) RecordProperty(name, count);
  ASSERT_NEAR(counts["thousand_of_nothing"], 1000, 2);
  EXPECT_GT(counts["set_arms_o"], 1000) << "too few to be the call at all";
  EXPECT_LE(counts["set_arms_o"], 8000);
  EXPECT_LE(counts["set_arms_x"], 800);
  EXPECT_GT(counts["mix_and_speeds_for"], 500);
  EXPECT_LE(counts["mix_and_speeds_for"], 1500);
  EXPECT_LE(counts["layout"] + counts["set_layout"], 4500);
  EXPECT_LE(counts["mix_short_of_all"], 20'000);
}

TEST_P(OnArm, NoArithmeticInDoubleIsLeftAndTheCodeIsSmall) {
  const OnBoard board(GetParam(), "MinSizeRel");
  EXPECT_THAT(board.names(), testing::HasSubstr("kphi_speeds_for"));
  EXPECT_THAT(board.names(), testing::Not(testing::HasSubstr("__aeabi_d")));
  RecordProperty("code_bytes", static_cast<int>(board.code_bytes()));
  EXPECT_GT(board.code_bytes(), 5'000);
  EXPECT_LE(board.code_bytes(), 15'000);
}

INSTANTIATE_TEST_SUITE_P(Processors, OnArm, testing::Values(kM4f, kM7),
                         [](const auto& one) { return one.param.name == std::string("cortex-m4") ? "M4F" : "M7"; });

}  // namespace arm_test
}  // namespace kphi::test
