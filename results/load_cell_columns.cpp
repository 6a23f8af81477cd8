#include "results/load_cell_columns.hpp"

#include <algorithm>

namespace kphi::results {
namespace {

constexpr std::size_t kPiece = 8192;  // rows: 230 kB, which the second-level cache holds

}  // namespace

LoadCellStamps stamps_of(std::span<const LoadCellRecord> records) {
  LoadCellStamps stamps;
  stamps.ft_sequence.reserve(records.size());
  stamps.arrival_ns.reserve(records.size());
  for (const LoadCellRecord& record : records) {
    stamps.ft_sequence.push_back(record.ft_sequence);
    stamps.arrival_ns.push_back(record.arrival_ns);
  }
  return stamps;
}

LoadCellRows LoadCellColumns::rows(std::size_t first, std::size_t last) {
  if (first < first_ || last > first_ + counts_.size()) {
    const std::size_t n = std::min(std::max(last - first, kPiece), size_ - first);
    counts_.resize(n);
    status_.resize(n);
    read(first, counts_, status_);
    first_ = first;
  }
  return {std::span(counts_).subspan(first - first_, last - first),
          std::span(status_).subspan(first - first_, last - first)};
}

void RecordedColumns::read(std::size_t first, std::span<std::array<std::int32_t, 6>> counts,
                           std::span<std::uint32_t> status) const {
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i] = records_[first + i].counts;
    status[i] = records_[first + i].status;
  }
}

LoadCellStamps FileColumns::stamps() const {
  LoadCellStamps stamps{std::vector<std::uint32_t>(size_), std::vector<Nanoseconds>(size_)};
  places_.ft_sequence.read(file_, 0, size_, stamps.ft_sequence.data());
  places_.arrival.read(file_, 0, size_, stamps.arrival_ns.data());
  return stamps;
}

void FileColumns::read(std::size_t first, std::span<std::array<std::int32_t, 6>> counts,
                       std::span<std::uint32_t> status) const {
  places_.counts.read(file_, first, counts.size(), counts.data());
  places_.status.read(file_, first, status.size(), status.data());
}

}  // namespace kphi::results
