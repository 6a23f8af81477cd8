// Figures beside their goals, one per line, each a ratio: `./run bench` gathers them at its end.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string_view>

namespace kphi::bench {

/// `ratio` of what is said to what it is said to be divided by; met when it is not above `goal`.
inline void at_most(double goal, double ratio, std::string_view what) {
  fmt::print("ratio {:8.2f}  goal <= {:<4g} {:<6} {}\n", ratio, goal, ratio <= goal ? "met" : "MISSED", what);
  std::fflush(stdout);
}

/// Met when it is not below `goal`.
inline void at_least(double goal, double ratio, std::string_view what) {
  fmt::print("ratio {:8.2f}  goal >= {:<4g} {:<6} {}\n", ratio, goal, ratio >= goal ? "met" : "MISSED", what);
  std::fflush(stdout);
}

/// Where no goal has been set.
inline void compared(double ratio, std::string_view what) {
  fmt::print("ratio {:8.2f}  {:<19} {}\n", ratio, "", what);
  std::fflush(stdout);
}

}  // namespace kphi::bench
