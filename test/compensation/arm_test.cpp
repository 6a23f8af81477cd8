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

TEST_P(OnArm, CallsTakeAsManyInstructionsStackAndMemoryAsPromised) {
  for (const Build& build : kBuilds) {
    SCOPED_TRACE(build.type);
    const OnBoard board(GetParam(), build.type);
    auto counts = board.counts();
    for (const auto& [name, count] : counts) RecordProperty(build.type + ("_" + name), count);
    ASSERT_NEAR(counts["thousand_of_nothing"], 1000, 2);
    EXPECT_GT(counts["set_arms_o"], 1000) << "too few to be the call at all";
    EXPECT_LE(counts["set_arms_o"], build.set_arms_o);
    EXPECT_LE(counts["set_arms_x"], 500);
    EXPECT_GT(counts["mix_and_speeds_for"], 500);
    EXPECT_LE(counts["mix_and_speeds_for"], build.mix_and_speeds_for);
    EXPECT_LE(counts["layout"] + counts["set_layout"], 2500);
    EXPECT_GT(counts["longest_search"], 5'000);
    EXPECT_LE(counts["longest_search"], build.longest_search);
    EXPECT_LE(counts["longest_search_curved"], build.longest_search);
    EXPECT_GT(counts["factor_update"], 20);
    EXPECT_LE(counts["factor_update"] + counts["factor_estimate"], 300) << "one step of the online estimate";
    ASSERT_EQ(counts["stacks_are_of_what_flies"], 1);
    for (const auto& [name, count] : counts) {
      if (name.rfind("stack_", 0) != 0) continue;
      EXPECT_GT(count, name.find("factor") == std::string::npos ? 50 : 15) << name;
      EXPECT_LE(count, kStack) << name;
    }
    EXPECT_LE(counts["bytes_compensator"], kCompensatorBytes);
    EXPECT_LE(counts["bytes_mixer"], 400);
    RecordProperty(build.type + std::string("_code"), static_cast<int>(board.code_bytes()));
    EXPECT_GT(board.code_bytes(), 5'000);
    EXPECT_LE(board.code_bytes(), build.code);

    // The page tells the same, but for the longest of many more searches.
    const Figures found = OnBoard::figures_of(counts, board.code_bytes()), told = figures_told(GetParam(), build);
    SCOPED_TRACE(row_of(GetParam(), build, found));
    for (const Column column : {kCode, kKept, kDeepest, kSetArmsInO, kMixAndSpeeds})
      EXPECT_NEAR(found[column], told[column], 0.01 * told[column]) << column;
    for (const Column column : {kLongest, kLongestCurved})
      EXPECT_TRUE(found[column] <= 1.01 * told[column] && told[column] <= build.longest_search) << column;

    EXPECT_THAT(board.names(), testing::HasSubstr("kphi_speeds_for"));
    EXPECT_THAT(board.names(), testing::Not(testing::HasSubstr("__aeabi_d"))) << "arithmetic in double";
  }
}

INSTANTIATE_TEST_SUITE_P(Processors, OnArm, testing::Values(kM4f, kM7),
                         [](const auto& one) { return one.param.name == std::string("cortex-m4") ? "M4F" : "M7"; });

}  // namespace arm_test
}  // namespace kphi::test
