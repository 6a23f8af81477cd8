#include "results/load_cell_columns.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

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

bool any(Four numbers) { return (numbers[0] | numbers[1] | numbers[2] | numbers[3]) != 0; }

/// At least as large as every |count| - 1: their bits, or-ed.
struct Largest {
  void add(const Counts& counts) {
    const Four a = four(&counts[0]), b = four(&counts[2]);
    first |= a ^ (a >> 31);
    last |= b ^ (b >> 31);
  }
  Four first{}, last{};
};

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
  /// Whether one of the counts is at an end.
  [[nodiscard]] bool reached(const Counts& counts) const {
    const Four a = four(&counts[0]), b = four(&counts[2]);
    return any((a > first) | (a < -first) | (b > last) | (b < -last));
  }
  /// Quicker, of many counts: false if none is at an end.
  [[nodiscard]] bool may_be_reached(const Largest& largest) const {
    return any((largest.first >= first) | (largest.last >= last));
  }
  Four first, last;  // the largest counts inside
};

}  // namespace

LoadCellColumns::LoadCellColumns(const std::vector<LoadCellRecord>& records, const RunHeader& header) {
  const auto column = [&records](auto member) {
    std::vector<std::remove_cvref_t<decltype(records.front().*member)>> values;
    for (const LoadCellRecord& record : records) values.push_back(record.*member);
    return values;
  };
  reset(records.size());
  std::ranges::transform(records, ft_sequence.begin(), &LoadCellRecord::ft_sequence);
  take(0, column(&LoadCellRecord::counts), column(&LoadCellRecord::status), column(&LoadCellRecord::arrival_ns),
       header);
}

void LoadCellColumns::reset(std::size_t records) {
  const auto make_room = [records](auto& column) {
    // With something to spare for the next run, and without a copy of what nobody wants any more.
    if (records > column.capacity()) column = std::remove_reference_t<decltype(column)>(records + records / 8);
    column.resize(records);
  };
  make_room(force), make_room(torque), make_room(ft_sequence);
  marks.clear();
  datagrams.clear();
}

void LoadCellColumns::take(std::size_t first, std::span<const Counts> counts, std::span<const std::uint32_t> status,
                           std::span<const Nanoseconds> arrival_ns, const RunHeader& header) {
  const Limits limits(header.load_cell);
  const auto axis = static_cast<std::size_t>(std::clamp(header.thrust_axis, 0, 2));
  Largest largest;
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    force[first + i] = counts[i][axis];
    torque[first + i] = counts[i][axis + 3];
    largest.add(counts[i]);
    bits |= status[i];
  }
  for (std::size_t i = 0; i < counts.size();) {
    const Nanoseconds arrival = arrival_ns[i];
    if (datagrams.empty() || datagrams.back().arrival_ns != arrival) datagrams.push_back({0, arrival});
    while (i < counts.size() && arrival_ns[i] == arrival) ++i;
    datagrams.back().end = first + i;
  }
  if (bits == 0 && !limits.may_be_reached(largest)) return;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const Mark mark{first + i, status[i] == (kSummaryBit | kMonitorBit) ? 0u : status[i], limits.reached(counts[i])};
    if (mark.status != 0 || mark.at_limit) marks.push_back(mark);
  }
}

}  // namespace kphi::results
