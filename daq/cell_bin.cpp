#include "daq/cell_bin.hpp"

#include <span>

namespace kphi::daq {
namespace {

using Counts = std::array<std::int32_t, 6>;

constexpr std::uint32_t kMonitorBit = 1u << 16;  // a condition the user set; raises the summary bit, too
constexpr std::uint32_t kSummaryBit = 1u << 31;
// Squares of differences below this, and so many of them, fit into 64 bits together.
constexpr std::uint64_t kNear = 1u << 24;
constexpr std::size_t kMany = 1u << 15;

CountSums wide_sums(std::span<const Counts> counts, std::size_t axis, std::int32_t origin) {
  CountSums sums;
  for (const Counts& c : counts) {
    const std::int64_t difference = static_cast<std::int64_t>(c[axis]) - origin;
    sums.sum += difference;
    sums.squares += static_cast<Wide>(difference) * difference;
  }
  return sums;
}

CountSums sums_of(std::span<const Counts> counts, std::size_t axis, std::int32_t origin) {
  std::int64_t sum = 0;
  std::uint64_t squares = 0, magnitude = 0;
  for (const Counts& c : counts) {
    const std::int64_t difference = static_cast<std::int64_t>(c[axis]) - origin;
    sum += difference;
    squares += static_cast<std::uint64_t>(difference) * static_cast<std::uint64_t>(difference);
    magnitude |= static_cast<std::uint64_t>(difference ^ (difference >> 63));
  }
  if (magnitude >= kNear || counts.size() > kMany) return wide_sums(counts, axis, origin);
  return {sum, static_cast<Wide>(squares)};
}

bool reach(std::span<const Counts> counts, const Counts& limits) {
  // Two records at a time: twelve numbers side by side, in whole vector registers.
  std::array<std::int32_t, 12> found{}, high{}, low{};
  for (std::size_t i = 0; i < found.size(); ++i) {
    high[i] = limits[i % 6];
    low[i] = -limits[i % 6];
  }
  const std::int32_t* at = counts.empty() ? nullptr : counts.front().data();
  for (std::size_t pair = 0; pair < counts.size() / 2; ++pair, at += found.size()) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i] |= static_cast<std::int32_t>(at[i] >= high[i]) | static_cast<std::int32_t>(at[i] <= low[i]);
    }
  }
  std::int32_t any = 0;
  for (const std::int32_t one : found) any |= one;
  if (counts.size() % 2 == 1) {
    for (std::size_t i = 0; i < 6; ++i) {
      any |= static_cast<std::int32_t>(counts.back()[i] >= high[i]) |
             static_cast<std::int32_t>(counts.back()[i] <= low[i]);
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
  force.add(sums_of(rows.counts, frame.axis, frame.force_origin));
  torque.add(sums_of(rows.counts, frame.axis + 3, frame.torque_origin));
  n += static_cast<std::uint32_t>(rows.counts.size());
  status |= bits_of(rows.status);
  at_limit |= reach(rows.counts, frame.limits);
}

bool CellBin::frozen() const { return n > 1 && force.squares * n == static_cast<Wide>(force.sum) * force.sum; }

}  // namespace kphi::daq
