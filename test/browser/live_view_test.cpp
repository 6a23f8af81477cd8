// The live page in a real browser, before the real program: what live_view_test.mjs looks at, watched as every test of
// this computer's clock is.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>

#include "test/end_to_end/process.hpp"
#include "test/end_to_end/program.hpp"

namespace kphi::test {
namespace {

constexpr int kSkipped = 77, kNotSafe = 3;  // of live_view_test.mjs

TEST(Browser, LooksAtARunAndStopsIt) {
  if (std::system("command -v node >/dev/null") != 0) GTEST_SKIP() << "no node; ./run peers installs it";
  // It has the processors that nobody else wants: its own priorities keep even the kernel's threads waiting that hand
  // on what a pseudo-terminal hears, and with them the motor's readings.
  Process node({"chrt", "-i", "0", "node", KPHI_BROWSER_TEST, kphi(), KPHI_NODE_MODULES, KPHI_PICTURES});
  const int ended = node.wait(std::chrono::seconds(380));
  if (ended == kSkipped) GTEST_SKIP() << node.out().substr(0, node.out().find('\n'));
  EXPECT_EQ(ended, 0) << node.out() << node.err();
  EXPECT_TRUE(safely(ended != kNotSafe));
}

}  // namespace
}  // namespace kphi::test
