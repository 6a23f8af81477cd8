#include "daq/cell_bin.hpp"

#include <cstdlib>
#include <limits>
#include <span>

namespace kphi::daq {
namespace {

using Counts = std::array<std::int32_t, 6>;

constexpr std::uint32_t kMonitorBit = 1u << 16;  // a condition the user set; raises the summary bit, too
constexpr std::uint32_t kSummaryBit = 1u << 31;
CountSums wide_sums(std::span<const Counts> counts, std::size_t axis, std::int32_t origin) {
  CountSums sums;
  for (const Counts& c : counts) {
    const std::int64_t difference = static_cast<std::int64_t>(c[axis]) - origin;
    sums.sum += difference;
    sums.squares += static_cast<Wide>(difference) * difference;
  }
  return sums;
}

/// Of so few or so small differences that their squares fit into 64 bits together.
CountSums sums_of(std::span<const Counts> counts, std::size_t axis, std::int32_t origin) {
  std::int64_t sum = 0, squares = 0;
  for (const Counts& c : counts) {
    const std::int64_t difference = static_cast<std::int64_t>(c[axis]) - origin;
    sum += difference;
    squares += difference * difference;
  }
  return {sum, squares};
}

/// Whether the squares of `n` differences between counts inside their limit and an origin fit into 64 bits together.
bool fit(std::size_t n, std::int32_t limit, std::int32_t origin) {
  const Wide farthest = static_cast<Wide>(limit) + std::abs(static_cast<std::int64_t>(origin));
  return farthest * farthest * static_cast<Wide>(n) <= std::numeric_limits<std::int64_t>::max();
}

bool reach(std::span<const Counts> counts, const Counts& limits) {
  // Two records at a time: twelve numbers side by side, in whole vector registers.
  std::array<std::int32_t, 12> found{}, high{}, low{};
  for (std::size_t i = 0; i < found.size(); ++i) {
    high[i] = limits[i % 6] - 1;
    low[i] = 1 - limits[i % 6];
  }
  const std::int32_t* at = counts.empty() ? nullptr : counts.front().data();
  for (std::size_t pair = 0; pair < counts.size() / 2; ++pair, at += found.size()) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i] |= -static_cast<std::int32_t>(at[i] > high[i]) | -static_cast<std::int32_t>(at[i] < low[i]);
    }
  }
  std::int32_t any = 0;
  for (const std::int32_t one : found) any |= one;
  if (counts.size() % 2 == 1) {
    for (std::size_t i = 0; i < 6; ++i) {
      any |=
          static_cast<std::int32_t>(counts.back()[i] > high[i]) | static_cast<std::int32_t>(counts.back()[i] < low[i]);
    }
  }
  return any != 0;
}

std::uint32_t bits_of(std::span<const std::uint32_t> status) {
  std::uint32_t bits = 0;
  for (const std::uint32_t word : status) bits |= word == (kSummaryBit | kMonitorBit) ? 0u : word;
  return bits;
}

}  // namespace

void CellBin::add(const results::LoadCellRows& rows, const CountFrame& frame) {
  const bool reached = reach(rows.counts, frame.limits);
  const auto take = [&](std::size_t axis, std::int32_t origin) {
    const bool near = !reached && fit(rows.counts.size(), frame.limits[axis], origin);
    return near ? sums_of(rows.counts, axis, origin) : wide_sums(rows.counts, axis, origin);
  };
  force.add(take(frame.axis, frame.force_origin));
  torque.add(take(frame.axis + 3, frame.torque_origin));
  n += static_cast<std::uint32_t>(rows.counts.size());
  status |= bits_of(rows.status);
  at_limit |= reached;
}

bool CellBin::frozen() const { return n > 1 && force.squares * n == static_cast<Wide>(force.sum) * force.sum; }

}  // namespace kphi::daq
