#include "results/load_cell_columns.hpp"

#include <cstring>
#include <limits>

namespace kphi::results {
namespace {

using Counts = LoadCellColumns::Counts;

/// Four numbers in one register.
using Four [[gnu::vector_size(16)]] = std::int32_t;

Four four(const std::int32_t* from) {
  Four numbers;
  std::memcpy(&numbers, from, sizeof numbers);
  return numbers;
}

/// The ends of the six ranges.
struct Limits {
  explicit Limits(const LoadCellScale& scale) {
    Counts counts{};
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const double range = scale.range[i] * (i < 3 ? scale.counts_per_newton : scale.counts_per_newton_metre);
      const double full = std::numeric_limits<std::int32_t>::max();
      counts[i] = static_cast<std::int32_t>(range > 0 && range < full ? range : full);
    }
    first = four(&counts[0]) - 1;
    last = four(&counts[2]) - 1;
  }
  /// Which of the counts are at an end.
  [[nodiscard]] Four reached(const Counts& counts) const {
    const Four a = four(&counts[0]), b = four(&counts[2]);
    return (a > first) | (a < -first) | (b > last) | (b < -last);
  }
  Four first, last;  // the largest counts inside
};

bool any(Four numbers) { return (numbers[0] | numbers[1] | numbers[2] | numbers[3]) != 0; }

}  // namespace

LoadCellColumns::LoadCellColumns(const std::vector<LoadCellRecord>& records, const RunHeader& header) {
  std::vector<Counts> counts;
  std::vector<std::uint32_t> status;
  std::vector<Nanoseconds> arrival_ns;
  reset(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    counts.push_back(records[i].counts);
    status.push_back(records[i].status);
    arrival_ns.push_back(records[i].arrival_ns);
    ft_sequence[i] = records[i].ft_sequence;
  }
  take(0, counts, status, arrival_ns, header);
}

void LoadCellColumns::reset(std::size_t records) {
  force.resize(records);
  torque.resize(records);
  ft_sequence.resize(records);
  marks.clear();
  datagrams.clear();
}

void LoadCellColumns::take(std::size_t first, std::span<const Counts> counts, std::span<const std::uint32_t> status,
                           std::span<const Nanoseconds> arrival_ns, const RunHeader& header) {
  const Limits limits(header.load_cell);
  const auto axis = static_cast<std::size_t>(header.thrust_axis);
  Four reached{};
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    force[first + i] = counts[i][axis];
    torque[first + i] = counts[i][axis + 3];
    reached |= limits.reached(counts[i]);
    bits |= status[i];
  }
  for (std::size_t i = 0; i < counts.size();) {
    const Nanoseconds arrival = arrival_ns[i];
    if (datagrams.empty() || datagrams.back().arrival_ns != arrival) datagrams.push_back({0, arrival});
    while (i < counts.size() && arrival_ns[i] == arrival) ++i;
    datagrams.back().end = first + i;
  }
  if (bits == 0 && !any(reached)) return;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const Mark mark{first + i, status[i] == (kSummaryBit | kMonitorBit) ? 0u : status[i],
                    any(limits.reached(counts[i]))};
    if (mark.status != 0 || mark.at_limit) marks.push_back(mark);
  }
}

}  // namespace kphi::results
