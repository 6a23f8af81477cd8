#include "daq/hardware/terminal_watch.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>

#include "test/soon.hpp"

namespace kphi::daq {
namespace terminal_watch_test {

using std::chrono::milliseconds;

TEST(TerminalWatch, SaysNothingWhereBytesAreHandedOn) {
  const TerminalWatch watch;
  EXPECT_TRUE(test::soon([&] { return watch.late() > Duration(0); })) << "each takes a little";
}

TEST(TerminalWatch, SaysHowLateAByteIsThatDoesNotCome) {
  std::array<int, 2> sent{}, heard{};
  ASSERT_EQ(::pipe(sent.data()), 0);
  ASSERT_EQ(::pipe(heard.data()), 0);
  const Descriptor nobody_reads(sent[0]), speaks(heard[1]);
  const TerminalWatch watch({Descriptor(sent[1]), Descriptor(heard[0])});
  EXPECT_TRUE(test::soon([&] { return watch.late() > milliseconds(60); }));
}

}  // namespace terminal_watch_test
}  // namespace kphi::daq
