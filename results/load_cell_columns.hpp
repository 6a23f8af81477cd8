// The load-cell records of one run, column by column: from memory, or straight from the run file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/descriptor.hpp"
#include "results/records.hpp"

namespace kphi::results {

/// A column whose chunks lie in the run file as they do in memory: any thread can read it without HDF5.
struct RawColumn {
  std::string doing;  ///< "file: read counts", for errors
  std::size_t row_bytes = 0;
  std::uint64_t chunk_rows = 0;
  std::vector<std::uint64_t> chunks;  ///< offsets in the file

  /// Rows [first, first + count). Throws RecordError if the file ends before.
  void read(const Descriptor& file, std::uint64_t first, std::uint64_t count, void* rows) const;
};

/// Neighbouring records.
struct LoadCellRows {
  std::span<const std::array<std::int32_t, 6>> counts;
  std::span<const std::uint32_t> status;
};

/// One thread at a time. Reading throws RecordError.
class LoadCellColumns {
 public:
  virtual ~LoadCellColumns() = default;
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] virtual std::vector<std::uint32_t> ft_sequence() const = 0;
  /// Arrival of the records from `first` on; fills the span.
  virtual void read_arrival(std::size_t first, std::span<Nanoseconds> arrival_ns) const = 0;
  /// Records [first, last); valid until the next call. Reads the following ones along, so that going on is cheap.
  [[nodiscard]] LoadCellRows rows(std::size_t first, std::size_t last);

 protected:
  explicit LoadCellColumns(std::size_t size) : size_(size) {}
  const std::size_t size_;

 private:
  virtual void read(std::size_t first, std::span<std::array<std::int32_t, 6>> counts,
                    std::span<std::uint32_t> status) const = 0;
  std::size_t first_ = 0;  ///< index of the first record held
  std::vector<std::array<std::int32_t, 6>> counts_;
  std::vector<std::uint32_t> status_;
};

/// The records must outlive it.
class RecordedColumns : public LoadCellColumns {
 public:
  explicit RecordedColumns(std::span<const LoadCellRecord> records)
      : LoadCellColumns(records.size()), records_(records) {}
  [[nodiscard]] std::vector<std::uint32_t> ft_sequence() const override;
  void read_arrival(std::size_t first, std::span<Nanoseconds> arrival_ns) const override;

 private:
  void read(std::size_t first, std::span<std::array<std::int32_t, 6>> counts,
            std::span<std::uint32_t> status) const override;
  std::span<const LoadCellRecord> records_;
};

class FileColumns : public LoadCellColumns {
 public:
  struct Places {
    RawColumn counts, ft_sequence, status, arrival;
  };
  /// Throws RecordError.
  FileColumns(const std::filesystem::path& path, std::size_t rows, Places places);
  [[nodiscard]] std::vector<std::uint32_t> ft_sequence() const override;
  void read_arrival(std::size_t first, std::span<Nanoseconds> arrival_ns) const override;

 private:
  void read(std::size_t first, std::span<std::array<std::int32_t, 6>> counts,
            std::span<std::uint32_t> status) const override;
  Descriptor file_;
  Places places_;
};

}  // namespace kphi::results
