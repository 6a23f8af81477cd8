// The load cell's records of one run, column by column: out of memory, or straight out of the run file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "results/raw_column.hpp"
#include "results/records.hpp"

namespace kphi::results {

/// What neighbouring records say.
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
  /// Of the records from `first` on, as many as there is room for.
  virtual void read_arrival(std::size_t first, std::span<Nanoseconds> arrival_ns) const = 0;
  /// Of records [first, last); valid until the next call. Neighbours are read along, so that going on is cheap.
  [[nodiscard]] LoadCellRows rows(std::size_t first, std::size_t last);

 protected:
  explicit LoadCellColumns(std::size_t size) : size_(size) {}
  const std::size_t size_;

 private:
  virtual void read(std::size_t first, std::span<std::array<std::int32_t, 6>> counts,
                    std::span<std::uint32_t> status) const = 0;
  std::size_t first_ = 0;  ///< of those that are held
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
  FileColumns(OpenFile file, std::size_t rows, Places places)
      : LoadCellColumns(rows), file_(std::move(file)), places_(std::move(places)) {}
  [[nodiscard]] std::vector<std::uint32_t> ft_sequence() const override;
  void read_arrival(std::size_t first, std::span<Nanoseconds> arrival_ns) const override;

 private:
  void read(std::size_t first, std::span<std::array<std::int32_t, 6>> counts,
            std::span<std::uint32_t> status) const override;
  OpenFile file_;
  Places places_;
};

}  // namespace kphi::results
