#include "results/load_cell_columns.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/error.hpp"
#include "results/file_layer.hpp"

namespace kphi::results {
namespace {

constexpr std::size_t kPiece = 8192;  // rows: 230 kB, which the second-level cache holds

void read_all(int file, std::uint64_t offset, std::size_t bytes, std::byte* to, const std::string& doing) {
  while (bytes > 0) {
    const ssize_t n = ::pread(file, to, bytes, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw RecordError(failure_text(doing, errno));
    if (n == 0) throw RecordError(doing + ": the file ends too early; see kphi verify");
    to += n;
    offset += static_cast<std::uint64_t>(n);
    bytes -= static_cast<std::size_t>(n);
  }
}

}  // namespace

void RawColumn::read(const Descriptor& file, std::uint64_t first, std::uint64_t count, void* rows) const {
  auto* to = static_cast<std::byte*>(rows);
  while (count > 0) {
    const std::uint64_t chunk = first / chunk_rows, row = first % chunk_rows;
    const std::uint64_t n = std::min(count, chunk_rows - row);
    if (chunk >= chunks.size()) throw RecordError(doing + ": holds fewer rows than asked for");
    read_all(file.number(), chunks[chunk] + row * row_bytes, n * row_bytes, to, doing);
    to += n * row_bytes;
    first += n;
    count -= n;
  }
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

std::vector<std::uint32_t> RecordedColumns::ft_sequence() const {
  std::vector<std::uint32_t> ft;
  ft.reserve(records_.size());
  for (const LoadCellRecord& record : records_) ft.push_back(record.ft_sequence);
  return ft;
}

void RecordedColumns::read_arrival(std::size_t first, std::span<Nanoseconds> arrival_ns) const {
  for (std::size_t i = 0; i < arrival_ns.size(); ++i) arrival_ns[i] = records_[first + i].arrival_ns;
}

void RecordedColumns::read(std::size_t first, std::span<std::array<std::int32_t, 6>> counts,
                           std::span<std::uint32_t> status) const {
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i] = records_[first + i].counts;
    status[i] = records_[first + i].status;
  }
}

FileColumns::FileColumns(const std::filesystem::path& path, std::size_t rows, Places places)
    : LoadCellColumns(rows), file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)), places_(std::move(places)) {
  if (file_.number() < 0) throw RecordError(failure_text(path.string() + ": open", errno));
}

std::vector<std::uint32_t> FileColumns::ft_sequence() const {
  std::vector<std::uint32_t> ft(size_);
  places_.ft_sequence.read(file_, 0, size_, ft.data());
  return ft;
}

void FileColumns::read_arrival(std::size_t first, std::span<Nanoseconds> arrival_ns) const {
  places_.arrival.read(file_, first, arrival_ns.size(), arrival_ns.data());
}

void FileColumns::read(std::size_t first, std::span<std::array<std::int32_t, 6>> counts,
                       std::span<std::uint32_t> status) const {
  places_.counts.read(file_, first, counts.size(), counts.data());
  places_.status.read(file_, first, status.size(), status.data());
}

}  // namespace kphi::results
