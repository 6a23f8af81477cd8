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
  std::printf("%-10s %-15s %7s %6s %6s %9s %9s %9s %9s %9s\n", "", "", "code", "bytes", "stack", "set_arms", "set_arms",
              "mix and", "longest", "with a");
  std::printf("%-10s %-15s %7s %6s %6s %9s %9s %9s %9s %9s\n", "", "", "bytes", "kept", "bytes", "in X", "in O",
              "speeds", "search", "bent κ");
  for (const Processor& processor : {kM4f, kM7}) {
    for (const Build& build : kBuilds) {
      const OnBoard board(processor, build.type, true, kDemands);
      const auto counts = board.counts();
      int stack = 0;
      for (const auto& [name, count] : counts) stack = name.rfind("stack_", 0) == 0 ? std::max(stack, count) : stack;
      const int longest = std::max(counts.at("longest_search"), counts.at("longest_search_curved"));
      std::printf("%-10s %-15s %7ld %6d %6d %9d %9d %9d %9d %9d\n", processor.name, build.type, board.code_bytes(),
                  counts.at("bytes_compensator") + counts.at("bytes_mixer"), stack, counts.at("set_arms_x"),
                  counts.at("set_arms_o"), counts.at("mix_and_speeds_for"), counts.at("longest_search"),
                  counts.at("longest_search_curved"));
      const auto at_most = [&](double of, const char* what) {
        kphi::bench::at_most(1, of, fmt::format("{}, {}: {}", processor.name, build.type, what));
      };
      at_most(static_cast<double>(board.code_bytes()) / build.code, "code over its bound");
      at_most(counts.at("set_arms_o") / static_cast<double>(build.set_arms_o), "set_arms in O over its bound");
      at_most(counts.at("mix_and_speeds_for") / static_cast<double>(build.mix_and_speeds_for),
              "mix and speeds_for over their bound");
      at_most(longest / static_cast<double>(build.longest_search), "longest of 100,000 searches over its bound");
      at_most(stack / static_cast<double>(kStack), "deepest stack over 1 kB");
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
