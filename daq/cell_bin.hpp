// Sums of the load cell's samples within a stretch of time. They are whole numbers: counts about an origin, and their
// squares. So any order of adding, any number of threads and any cut into bins gives the same sums, and the same bytes
// in steps.csv.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "results/load_cell_columns.hpp"

namespace kphi::daq {

__extension__ using Wide = __int128;

/// Of one axis, about `origin`.
struct CountSums {
  std::int64_t sum = 0;
  Wide squares = 0;
  void add(const CountSums& other) {
    sum += other.sum;
    squares += other.squares;
  }
};

/// What is summed: the thrust axis, the torque about it, and what both are counted from.
struct CountFrame {
  std::size_t axis = 2;  ///< 0..2
  std::int32_t force_origin = 0;
  std::int32_t torque_origin = 0;
  std::array<std::int32_t, 6> limits{};  ///< ends of the ranges, counts
};

struct CellBin {
  CountSums force, torque;
  std::uint32_t n = 0;
  std::uint32_t status = 0;  ///< all set bits, without healthy monitor words
  bool at_limit = false;     ///< a count of some axis at the end of its range
  void add(const results::LoadCellRows& rows, const CountFrame& frame);
  [[nodiscard]] bool frozen() const;  ///< more than one sample, and no force differs
};

}  // namespace kphi::daq
