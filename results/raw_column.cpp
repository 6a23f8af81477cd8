#include "results/raw_column.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/error.hpp"
#include "results/file_layer.hpp"

namespace kphi::results {
namespace {

void read_all(int file, std::uint64_t offset, std::size_t bytes, std::byte* to, const std::string& doing) {
  while (bytes > 0) {
    const ssize_t n = ::pread(file, to, bytes, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw RecordError(failure_text(doing, errno));
    if (n == 0) throw RecordError(doing + ": the file ends before it; see kphi verify");
    to += n;
    offset += static_cast<std::uint64_t>(n);
    bytes -= static_cast<std::size_t>(n);
  }
}

}  // namespace

OpenFile::OpenFile(const std::filesystem::path& path) : descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (descriptor_ < 0) throw RecordError(failure_text(path.string() + ": open", errno));
}

OpenFile::OpenFile(OpenFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

OpenFile::~OpenFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void RawColumn::read(const OpenFile& file, std::uint64_t first, std::uint64_t count, void* rows) const {
  auto* to = static_cast<std::byte*>(rows);
  while (count > 0) {
    const std::uint64_t chunk = first / chunk_rows, row = first % chunk_rows;
    const std::uint64_t n = std::min(count, chunk_rows - row);
    if (chunk >= chunks.size()) throw RecordError(doing + ": holds fewer rows than asked for");
    read_all(file.descriptor(), chunks[chunk] + row * row_bytes, n * row_bytes, to, doing);
    to += n * row_bytes;
    first += n;
    count -= n;
  }
}

}  // namespace kphi::results
