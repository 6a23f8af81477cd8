// HDF5's C API behind handles that close themselves and errors that throw. Its automatic error print is off. Files are
// made without time stamps, with metadata checksums and tracked creation order: the same calls give the same bytes.
// hid_t appears only here, in checked_heap and in run_writer. Debian's library is thread-safe; one object, one thread.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "results/digest.hpp"
#include "results/file_layer.hpp"
#include "results/run_layout.hpp"

namespace kphi::results::hdf5 {

/// Owns one HDF5 identifier of any kind.
class Handle {
 public:
  Handle() = default;
  explicit Handle(hid_t id) : id_(id) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  /// Releases it; ignores failures.
  ~Handle();
  [[nodiscard]] hid_t get() const { return id_; }

 private:
  hid_t id_ = H5I_INVALID_HID;
};

/// Throws RecordError with HDF5's own cause when `status` (or `id`) is negative. `doing` reads "file: write counts".
void check(herr_t status, const std::string& doing);
[[nodiscard]] Handle own(hid_t id, const std::string& doing);

[[nodiscard]] Handle create_file(const std::filesystem::path& path);
[[nodiscard]] Handle open_file(const std::filesystem::path& path);
[[nodiscard]] Handle create_group(const Handle& parent, const char* name);
[[nodiscard]] Handle open_group(const Handle& parent, const char* name);
[[nodiscard]] bool has_dataset(const Handle& group, const char* name);
/// The file's descriptor, for fdatasync.
[[nodiscard]] int descriptor_of(const Handle& file);
/// Size of the file in bytes once HDF5 has written everything it holds back.
[[nodiscard]] std::uint64_t size_of(const Handle& file);
/// Stops HDF5 from printing errors on stderr in the calling thread. Creating and opening files does that, too.
void be_quiet() noexcept;
/// Keeps everything that HDF5 writes from now on away from the file, so that closing does not change a byte.
void sever(const Handle& file) noexcept;

// Attributes: std::string (UTF-8), double, std::int32_t, std::uint32_t, std::uint64_t, std::array<double, 6>. Writing
// an existing one of the same type replaces its value in place.
void write_attribute(const Handle& object, const char* name, const std::string& value);
void write_numbers(const Handle& object, const char* name, Stored stored, std::size_t n, const void* numbers);
template <class Value>
void write_attribute(const Handle& object, const char* name, const Value& value) {
  constexpr Stored kStored = layout::stored_as<Value>();
  write_numbers(object, name, kStored, sizeof value / bytes_of(kStored), &value);
}
[[nodiscard]] bool has_attribute(const Handle& object, const char* name);
void read_attribute(const Handle& object, const char* name, std::string& value);
void read_numbers(const Handle& object, const char* name, Stored stored, std::size_t n, void* numbers);
template <class Value>
void read_attribute(const Handle& object, const char* name, Value& value) {
  constexpr Stored kStored = layout::stored_as<Value>();
  read_numbers(object, name, kStored, sizeof value / bytes_of(kStored), &value);
}

/// A growing dataset; counts have a second dimension of six. Written chunk by chunk with H5Dwrite_chunk and never
/// filled beforehand. A partly filled chunk is written as it stands and later written again in its place.
class Column {
 public:
  Column(const Handle& group, const ColumnLayout& layout, std::size_t chunk_rows, FileLayer& files,
         const std::string& file_name);
  /// `rows` holds `count` rows in this machine's order (little-endian).
  void append(const void* rows, std::size_t count);
  /// Puts the partly filled chunk on disk.
  void flush();
  /// Rows appended so far.
  [[nodiscard]] std::uint64_t rows() const { return rows_; }
  /// CRC-32 of all rows appended so far.
  [[nodiscard]] std::uint32_t crc() const { return crc_; }
  /// Notes the CRC of all rows in the attribute `crc32`.
  void write_crc();
  [[nodiscard]] const Handle& dataset() const { return dataset_; }

 private:
  void write_chunk();
  std::size_t chunk_rows_;
  std::size_t row_bytes_;
  FileLayer* files_;
  std::string doing_;
  Handle dataset_;
  std::vector<std::byte> chunk_;
  std::uint64_t rows_ = 0;
  std::uint64_t written_ = 0;
  std::uint32_t crc_ = 0;
};

/// A dataset read in blocks of rows.
class ColumnReader {
 public:
  ColumnReader(const Handle& group, const char* name, Stored stored, const std::string& file);
  [[nodiscard]] std::uint64_t rows() const { return rows_; }
  void read(std::uint64_t first, std::uint64_t count, void* rows);
  /// From now on the rows that are read, in their order, are digested.
  void begin_digest() { digest_.emplace(); }
  /// XXH128 of the rows read since.
  [[nodiscard]] std::string digest() const { return digest_.value().hex(); }
  /// CRC-32 of all rows.
  [[nodiscard]] std::uint32_t crc();
  [[nodiscard]] const Handle& dataset() const { return dataset_; }

 private:
  void fetch(std::uint64_t first, std::uint64_t count, void* rows);
  std::string doing_;
  Handle type_;  ///< of a value in memory
  std::size_t row_bytes_;
  Handle dataset_;
  Handle space_;
  std::uint64_t rows_ = 0;
  std::vector<hsize_t> dims_;
  std::uint64_t chunk_rows_ = 0;
  std::vector<haddr_t> chunks_;  ///< where they lie in the file, if they lie there as in memory
  int descriptor_ = -1;
  std::optional<Xxh128> digest_;
};

/// Makes `scale` the dimension scale of dimension `dimension` of each of `datasets` (HDF5 Dimension Scale
/// specification), in a packed form without the padding that libhdf5_hl leaves to chance.
struct ScaleUse {
  const Handle* dataset;
  unsigned dimension;
};
void make_scale(const Handle& scale, const char* name, const std::vector<ScaleUse>& uses);
/// Writes DIMENSION_LIST: one scale per dimension of `dataset`; all scales are in the same file.
void attach_scales(const Handle& dataset, const std::vector<const Handle*>& scales);

}  // namespace kphi::results::hdf5
