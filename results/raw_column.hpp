// A column whose chunks lie in the run file as they do in memory: where, so that any thread can read it without HDF5.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kphi::results {

/// A file that is open for reading, closed with its owner.
class OpenFile {
 public:
  /// Throws RecordError.
  explicit OpenFile(const std::filesystem::path& path);
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&&) = delete;
  ~OpenFile();
  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  int descriptor_ = -1;
};

struct RawColumn {
  std::string doing;  ///< "file: read counts", for errors
  std::size_t row_bytes = 0;
  std::uint64_t chunk_rows = 0;
  std::vector<std::uint64_t> chunks;  ///< offsets in the file

  /// Rows [first, first + count). Throws RecordError when the file ends before.
  void read(const OpenFile& file, std::uint64_t first, std::uint64_t count, void* rows) const;
};

}  // namespace kphi::results
