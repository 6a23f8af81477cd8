// What a reduction needs of a run's load-cell records, column by column: half as many bytes as the records, so that a
// campaign is reduced at the speed of memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/huge_pages.hpp"
#include "results/records.hpp"

namespace kphi::results {

// Bits of the status word of every product.
inline constexpr std::uint32_t kMonitorBit = 1u << 16;  ///< a condition the user set; raises the summary bit, too
inline constexpr std::uint32_t kSummaryBit = 1u << 31;

struct LoadCellColumns {
  using Counts = std::array<std::int32_t, 6>;
  /// A record with a bit of the status set, or a count at the end of its range.
  struct Mark {
    std::size_t record = 0;
    std::uint32_t status = 0;  ///< 0 for a healthy monitor word
    bool at_limit = false;
  };

  /// Records that arrived together, from the end of the datagram before on.
  struct Datagram {
    std::size_t end = 0;
    Nanoseconds arrival_ns = 0;
  };

  LoadCellColumns() = default;
  LoadCellColumns(const std::vector<LoadCellRecord>& records,  // NOLINT: the same numbers in another order
                  const RunHeader& header = {});
  /// Makes room for so many records, of which none is there; uses memory again.
  void reset(std::size_t records);
  /// Takes all but ft_sequence of the records from `first` on, which follow those taken before.
  void take(std::size_t first, std::span<const Counts> counts, std::span<const std::uint32_t> status,
            std::span<const Nanoseconds> arrival_ns, const RunHeader& header);

  std::vector<std::int32_t, HugePages<std::int32_t>> force, torque;  ///< of the thrust axis and about it, counts
  std::vector<Mark> marks;                                           ///< in the order of the records
  std::vector<Datagram> datagrams;
  std::vector<std::uint32_t, HugePages<std::uint32_t>> ft_sequence;
};

}  // namespace kphi::results
