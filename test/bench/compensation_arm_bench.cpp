// The flying library on microcontrollers: instructions of single calls, counted under qemu, and bytes of code. In
// float, beside the same library in double on the same processor, whose floating-point unit knows no double.
#include <cstdio>

#include "test/bench/figures.hpp"
#include "test/compensation/arm/on_board.hpp"

int main() {
  using namespace kphi::test;
  if (const std::string missing = missing_for_boards(); !missing.empty()) {
    std::printf("%s\n", missing.c_str());
    return 0;
  }
  for (const Processor& processor : {kM4f, kM7}) {
    const auto in_float = OnBoard(processor, "Release").counts(),
               in_double = OnBoard(processor, "Release", false).counts();
    for (const auto& [name, count] : in_float) {
      std::printf("%-10s %-22s %7d instructions in float, %8d in double\n", processor.name, name.c_str(), count,
                  in_double.at(name));
    }
    const long small = OnBoard(processor, "MinSizeRel").code_bytes();
    std::printf("%-10s %-22s %7ld bytes in float, %8ld in double\n", processor.name, "code", small,
                OnBoard(processor, "MinSizeRel", false).code_bytes());
    const auto beside_double = [&](const char* name) {
      const double ratio = static_cast<double>(in_float.at(name)) / in_double.at(name);
      kphi::bench::compared(ratio, fmt::format("{}, {}: float over double", processor.name, name));
    };
    beside_double("set_arms_o");
    beside_double("mix_and_speeds_for");
    kphi::bench::at_most(1, in_float.at("set_arms_o") / 8000.0,
                         fmt::format("{}, set_arms in O: over 8000 instructions", processor.name));
    kphi::bench::at_most(1, in_float.at("mix_and_speeds_for") / 1500.0,
                         fmt::format("{}, mix and speeds_for: over 1500 instructions", processor.name));
    kphi::bench::at_most(1, static_cast<double>(small) / 10'000,
                         fmt::format("{}, code of the flight calls: over 10 kB", processor.name));
  }
  return 0;
}
