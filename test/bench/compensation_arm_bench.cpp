// The flying library on microcontrollers: code, memory, stack and instructions of single calls, counted under qemu, in
// three builds; beside the same library in double, whose numbers the floating-point unit there does not know.
#include <algorithm>
#include <cstdio>

#include "test/bench/figures.hpp"
#include "test/compensation/arm/on_board.hpp"

int main() {
  using namespace kphi::test;
  if (const std::string missing = missing_for_boards(); !missing.empty()) {
    std::printf("%s\n", missing.c_str());
    return 0;
  }
  constexpr int kDemands = 100'000;
  std::printf(
      "processor, build: bytes of code, of a Compensator and a Mixer, of the deepest stack; instructions of set_arms "
      "in O, of mix and speeds_for,\nof the longest of %d searches and of those with a torque that bends\n",
      kDemands);
  for (const Processor& processor : {kM4f, kM7}) {
    for (const Build& build : kBuilds) {
      const OnBoard board(processor, build.type, true, kDemands);
      const Figures found = OnBoard::figures_of(board.counts(), board.code_bytes());
      std::printf("%s\n", row_of(processor, build, found).c_str());
      const auto at_most = [&](double of, const char* what) {
        kphi::bench::at_most(1, of, fmt::format("{}, {}: {}", processor.name, build.type, what));
      };
      const int longest = std::max(found[kLongest], found[kLongestCurved]);
      at_most(found[kCode] / static_cast<double>(build.code), "code over its bound");
      at_most(found[kSetArmsInO] / static_cast<double>(build.set_arms_o), "set_arms in O over its bound");
      at_most(found[kMixAndSpeeds] / static_cast<double>(build.mix_and_speeds_for),
              "mix and speeds_for over their bound");
      at_most(longest / static_cast<double>(build.longest_search), "longest of 100,000 searches over its bound");
      at_most(found[kDeepest] / static_cast<double>(kStack), "deepest stack over 1 kB");
    }
    const auto in_float = OnBoard(processor, kBuilds[0].type).counts(),
               in_double = OnBoard(processor, kBuilds[0].type, false).counts();
    for (const char* name : {"set_arms_o", "mix_and_speeds_for"}) {
      const double ratio = static_cast<double>(in_float.at(name)) / in_double.at(name);
      kphi::bench::compared(ratio, fmt::format("{}, {}: float over double", processor.name, name));
    }
  }
  return 0;
}
