#include "results/hdf5.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstring>
#include <functional>
#include <system_error>
#include <utility>

#include "base/error.hpp"
#include "results/checked_heap.hpp"

namespace kphi::results::hdf5 {
namespace {

constexpr hsize_t kComponents = 6;   // of counts
constexpr hsize_t kManyRows = 4096;  // from here on it pays to look how chunks lie in the file

static_assert(std::endian::native == std::endian::little, "chunks are written as they lie in memory");

/// Of the bytes behind those with the CRC `before`.
std::uint32_t crc_32(std::uint32_t before, const std::byte* bytes, std::size_t n) {
  return static_cast<std::uint32_t>(::crc32_z(before, reinterpret_cast<const Bytef*>(bytes), n));
}

struct Cause {
  std::string text;
  int error = 0;
};

herr_t note(unsigned, const H5E_error2_t* entry, void* out) {
  auto& cause = *static_cast<Cause*>(out);
  const std::string text = entry->desc == nullptr ? "" : entry->desc;
  if (cause.text.empty()) cause.text = text;
  const auto at = text.find("errno = ");
  if (at != std::string::npos && cause.error == 0) cause.error = std::atoi(text.c_str() + at + 8);
  return 0;
}

/// The first entry of the error stack, the one nearest to the trouble; the stack is cleared.
Cause take_cause() {
  Cause cause;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, &note, &cause);
  H5Eclear2(H5E_DEFAULT);
  return cause;
}

[[noreturn]] void fail(const Cause& cause, const std::string& doing) {
  if (cause.error != 0) throw RecordError(failure_text(doing, cause.error));
  throw RecordError(fmt::format("{}: HDF5: {}", doing, cause.text.empty() ? "refused" : cause.text));
}

[[noreturn]] void fail(const std::string& doing) { fail(take_cause(), doing); }

Handle fixed_text(std::size_t size) {
  Handle type = own(H5Tcopy(H5T_C_S1), "text type");
  check(H5Tset_size(type.get(), size), "text type");
  return type;
}

Handle text_type() {
  Handle type = fixed_text(H5T_VARIABLE);
  check(H5Tset_cset(type.get(), H5T_CSET_UTF8), "text type");
  return type;
}

Handle scalar_space() { return own(H5Screate(H5S_SCALAR), "scalar"); }

Handle row_space(hsize_t n) { return own(H5Screate_simple(1, &n, nullptr), "row"); }

void put(const Handle& object, const char* name, hid_t file_type, hid_t memory_type, const Handle& space,
         const void* value) {
  const std::string doing = fmt::format("write attribute {}", name);
  const Handle attribute =
      has_attribute(object, name)
          ? own(H5Aopen(object.get(), name, H5P_DEFAULT), doing)
          : own(H5Acreate2(object.get(), name, file_type, space.get(), H5P_DEFAULT, H5P_DEFAULT), doing);
  check(H5Awrite(attribute.get(), memory_type, value), doing);
}

void get(const Handle& object, const char* name, hid_t memory_type, hssize_t elements, void* value) {
  const std::string doing = fmt::format("read attribute {}", name);
  const Handle attribute = own(H5Aopen(object.get(), name, H5P_DEFAULT), doing);
  const Handle space = own(H5Aget_space(attribute.get()), doing);
  if (H5Sget_simple_extent_npoints(space.get()) != elements)
    throw RecordError(doing + ": has the wrong number of values");
  check(H5Aread(attribute.get(), memory_type, value), doing);
}

Handle creation_list(hid_t kind, auto&& more) {
  Handle list = own(H5Pcreate(kind), "creation properties");
  check(H5Pset_obj_track_times(list.get(), false), "creation properties");
  check(H5Pset_attr_creation_order(list.get(), H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED), "creation properties");
  // All attributes stay in the object's header: one place, one checksum.
  check(H5Pset_attr_phase_change(list.get(), 256, 255), "creation properties");
  more(list.get());
  return list;
}

void track_links(hid_t list) {
  check(H5Pset_link_creation_order(list, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED), "creation properties");
}

void put_fixed_text(const Handle& object, const char* name, const std::string& value) {
  const Handle type = fixed_text(value.size() + 1);
  put(object, name, type.get(), type.get(), scalar_space(), value.c_str());
}

hobj_ref_t reference_to(const Handle& object) {
  hobj_ref_t reference{};
  check(H5Rcreate(&reference, object.get(), ".", H5R_OBJECT, -1), "reference");
  return reference;
}

/// Of one value: in the file little-endian, and in memory the same, for this machine is.
Handle type_of(Stored stored) {
  const std::array numbers{H5T_STD_U8LE,  H5T_STD_I32LE,  H5T_STD_U32LE, H5T_STD_I64LE,
                           H5T_STD_U64LE, H5T_IEEE_F64LE, H5T_STD_I32LE};
  static_assert(static_cast<std::size_t>(Stored::text) == numbers.size(), "in the order of Stored");
  if (stored != Stored::text) return own(H5Tcopy(numbers[static_cast<std::size_t>(stored)]), "type");
  Handle type = fixed_text(kEventTextBytes);  // not said to be UTF-8: Octave would refuse the whole file
  check(H5Tset_strpad(type.get(), H5T_STR_NULLPAD), "text type");
  return type;
}

/// The long name of a column; for a code "0 zero before, 1 step, …".
std::string described(const ColumnLayout& column) {
  std::string list;
  for (std::size_t code = 0; code < column.codes.size(); ++code)
    list += fmt::format("{}{} {}", code == 0 ? "" : ", ", code, column.codes[code]);
  return list.empty() ? column.long_name : list;
}

/// What kphi writes lies where its name says. A link may lead to another table, into another file, or to a pipe that
/// never answers.
void require_no_link(const Handle& parent, const char* name, const std::string& doing) {
  H5L_info_t link{};
  if (H5Lexists(parent.get(), name, H5P_DEFAULT) <= 0) return;
  check(H5Lget_info(parent.get(), name, &link, H5P_DEFAULT), doing);
  if (link.type != H5L_TYPE_HARD) throw RecordError(doing + ": a link that leads elsewhere; kphi writes none");
}

/// Before anything is allocated for its rows: what a table declares must be in this file.
void require_within_file(const Handle& dataset, std::uint64_t rows, std::size_t row_bytes, const std::string& doing) {
  const Handle list = own(H5Dget_create_plist(dataset.get()), doing);
  if (H5Pget_layout(list.get()) == H5D_VIRTUAL || H5Pget_external_count(list.get()) > 0)
    throw RecordError(doing + ": its rows lie in another file; kphi writes no such table");
  const std::uint64_t stored = H5Dget_storage_size(dataset.get());
  constexpr std::uint64_t kMostPacked = 10;
  const std::uint64_t most = H5Pget_nfilters(list.get()) > 0 ? kMostPacked * stored : stored;
  if (rows > most / row_bytes)
    throw RecordError(fmt::format("{}: {} rows are declared, {} bytes of them are in the file", doing, rows, stored));
}

/// No chunk cache: rows go from the file to the caller's memory at once.
hid_t without_cache() {
  static const Handle access = [] {
    Handle list = own(H5Pcreate(H5P_DATASET_ACCESS), "HDF5");
    check(H5Pset_chunk_cache(list.get(), 1, 0, 1.0), "HDF5");
    return list;
  }();
  return access.get();
}

}  // namespace

Handle::~Handle() {
  if (id_ >= 0 && H5Idec_ref(id_) < 0) H5Eclear2(H5E_DEFAULT);
}

void check(herr_t status, const std::string& doing) {
  if (status < 0) fail(doing);
}

void be_quiet() noexcept {
  // A file whose close was refused is half torn down; HDF5's own end-of-program cleaning would trip over it.
  static const herr_t no_cleaning = H5dont_atexit();
  thread_local const herr_t quiet = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  (void)no_cleaning;
  (void)quiet;
}

Handle own(hid_t id, const std::string& doing) {
  if (id < 0) fail(doing);
  return Handle(id);
}

namespace {

/// Without the library's lock on a file system that gives none: kphi has its own on the folder. Once without, always:
/// the library compares it with that of a file that is open.
std::atomic<bool> without_locks{false};

Handle with_lock_if_possible(const Handle& access, const std::string& doing, const std::function<hid_t()>& open) {
  const auto lock = [&](bool wanted) { check(H5Pset_file_locking(access.get(), wanted, true), doing); };
  lock(!without_locks);
  hid_t file = open();
  if (file < 0 && !without_locks) {
    const Cause cause = take_cause();
    if (cause.error != ENOLCK && !is_unknown_there(cause.error)) fail(cause, doing);
    without_locks = true;
    lock(false);
    file = open();
  }
  return own(file, doing);
}

}  // namespace

Handle create_file(const std::filesystem::path& path) {
  be_quiet();
  const Handle list = creation_list(H5P_FILE_CREATE, track_links);
  const Handle access = own(checked_access(), path.string());
  // 1.8: readable by every HDF5 since 2008, with checksums over its metadata.
  check(H5Pset_libver_bounds(access.get(), H5F_LIBVER_V18, H5F_LIBVER_V18), path.string());
  return with_lock_if_possible(access, path.string() + ": create", [&, flags = H5F_ACC_EXCL]() mutable {
    return H5Fcreate(path.c_str(), std::exchange(flags, H5F_ACC_TRUNC), list.get(), access.get());
  });
}

Handle open_file(const std::filesystem::path& path) {
  be_quiet();
  // The library would wait for somebody to write into a pipe.
  std::error_code none;
  if (std::filesystem::exists(path, none) && !std::filesystem::is_regular_file(path, none))
    throw RecordError(path.string() + ": open: this is a folder, a pipe or a device; name a run file");
  const Handle access = own(checked_access(), path.string() + ": open");
  // What is finished nobody writes any more.
  const bool is_finished = path.extension() != ".part";
  if (is_finished) check(H5Pset_file_locking(access.get(), false, true), path.string() + ": open");
  const auto open = [&] { return H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()); };
  const std::string doing = path.string() + ": open";
  return is_finished ? own(open(), doing) : with_lock_if_possible(access, doing, open);
}

Handle create_group(const Handle& parent, const char* name) {
  const Handle list = creation_list(H5P_GROUP_CREATE, track_links);
  return own(H5Gcreate2(parent.get(), name, H5P_DEFAULT, list.get(), H5P_DEFAULT),
             fmt::format("create group {}", name));
}

bool has_dataset(const Handle& group, const char* name) { return H5Lexists(group.get(), name, H5P_DEFAULT) > 0; }

Handle open_group(const Handle& parent, const char* name) {
  require_no_link(parent, name, fmt::format("open group {}", name));
  return own(H5Gopen2(parent.get(), name, H5P_DEFAULT), fmt::format("open group {}", name));
}

int descriptor_of(const Handle& file) {
  void* descriptor = nullptr;
  check(H5Fget_vfd_handle(file.get(), H5P_DEFAULT, &descriptor), "file descriptor");
  return *static_cast<int*>(descriptor);
}

std::uint64_t size_of(const Handle& file) {
  hsize_t size = 0;
  check(H5Fget_filesize(file.get(), &size), "file size");
  return size;
}

void sever(const Handle& file) noexcept {
  void* descriptor = nullptr;
  // Memory, not /dev/null: closing truncates the file, and that must succeed.
  const int nowhere = ::memfd_create("severed", MFD_CLOEXEC);
  if (nowhere >= 0 && H5Fget_vfd_handle(file.get(), H5P_DEFAULT, &descriptor) >= 0) {
    ::dup2(nowhere, *static_cast<int*>(descriptor));
  }
  if (nowhere >= 0) ::close(nowhere);
  H5Eclear2(H5E_DEFAULT);
}

void write_attribute(const Handle& object, const char* name, const std::string& value) {
  const Handle type = text_type();
  const char* text = value.c_str();
  put(object, name, type.get(), type.get(), scalar_space(), &text);
}

void write_numbers(const Handle& object, const char* name, Stored stored, std::size_t n, const void* numbers) {
  const Handle type = type_of(stored);
  put(object, name, type.get(), type.get(), n == 1 ? scalar_space() : row_space(n), numbers);
}

bool has_attribute(const Handle& object, const char* name) {
  const htri_t exists = H5Aexists(object.get(), name);
  check(exists, fmt::format("look for attribute {}", name));
  return exists > 0;
}

void read_attribute(const Handle& object, const char* name, std::string& value) {
  const Handle type = text_type();
  char* text = nullptr;
  get(object, name, type.get(), 1, &text);
  value = text == nullptr ? "" : text;
  H5free_memory(text);
}

void read_numbers(const Handle& object, const char* name, Stored stored, std::size_t n, void* numbers) {
  get(object, name, type_of(stored).get(), static_cast<hssize_t>(n), numbers);
}

Column::Column(const Handle& group, const ColumnLayout& layout, std::size_t chunk_rows, FileLayer& files,
               const std::string& file_name)
    : chunk_rows_(chunk_rows),
      row_bytes_(bytes_of(layout.stored)),
      files_(&files),
      doing_(fmt::format("{}: write {}", file_name, layout.name)),
      chunk_(chunk_rows * row_bytes_) {
  const int rank = layout.stored == Stored::counts ? 2 : 1;
  const std::array<hsize_t, 2> none{0, kComponents};
  const std::array<hsize_t, 2> most{H5S_UNLIMITED, kComponents};
  const std::array<hsize_t, 2> chunk{chunk_rows, kComponents};
  const Handle type = type_of(layout.stored);
  const Handle space = own(H5Screate_simple(rank, none.data(), most.data()), doing_);
  const Handle list = creation_list(H5P_DATASET_CREATE, [&](hid_t id) {
    check(H5Pset_chunk(id, rank, chunk.data()), doing_);
    check(H5Pset_fill_time(id, H5D_FILL_TIME_NEVER), doing_);
  });
  dataset_ =
      own(H5Dcreate2(group.get(), layout.name, type.get(), space.get(), H5P_DEFAULT, list.get(), H5P_DEFAULT), doing_);
  write_attribute(dataset_, "units", std::string(layout.unit));
  write_attribute(dataset_, "long_name", described(layout));
  write_attribute(dataset_, "crc32", std::uint32_t{0});
}

void Column::append(const void* rows, std::size_t count) {
  const auto* from = static_cast<const std::byte*>(rows);
  while (count > 0) {
    const std::size_t filled = rows_ % chunk_rows_;
    const std::size_t n = std::min<std::size_t>(count, chunk_rows_ - filled);
    std::memcpy(chunk_.data() + filled * row_bytes_, from, n * row_bytes_);
    crc_ = crc_32(crc_, from, n * row_bytes_);
    rows_ += n;
    from += n * row_bytes_;
    count -= n;
    if (rows_ % chunk_rows_ == 0) write_chunk();
  }
}

void Column::flush() {
  if (rows_ != written_) write_chunk();
}

void Column::write_chunk() {
  const std::array<hsize_t, 2> extent{rows_, kComponents};
  const std::array<hsize_t, 2> offset{(rows_ - 1) / chunk_rows_ * chunk_rows_, 0};
  on_disk(doing_, [&] { files_->before_write(chunk_.size()); });
  check(H5Dset_extent(dataset_.get(), extent.data()), doing_);
  check(H5Dwrite_chunk(dataset_.get(), H5P_DEFAULT, 0, offset.data(), chunk_.size(), chunk_.data()), doing_);
  written_ = rows_;
  if (rows_ % chunk_rows_ == 0) std::fill(chunk_.begin(), chunk_.end(), std::byte{0});
}

void Column::write_crc() { write_attribute(dataset_, "crc32", crc()); }

ColumnReader::ColumnReader(const Handle& group, const char* name, Stored stored, const std::string& file)
    : doing_(fmt::format("{}: read {}", file, name)), type_(type_of(stored)), row_bytes_(bytes_of(stored)) {
  require_no_link(group, name, doing_);
  dataset_ = own(H5Dopen2(group.get(), name, without_cache()), doing_);
  if (stored == Stored::text) type_ = own(H5Dget_type(dataset_.get()), doing_);  // of whatever character set
  space_ = own(H5Dget_space(dataset_.get()), doing_);
  const int rank = H5Sget_simple_extent_ndims(space_.get());
  if (rank < 1 || rank > 2) throw RecordError(doing_ + ": not one- or two-dimensional");
  dims_.resize(static_cast<std::size_t>(rank));
  check(H5Sget_simple_extent_dims(space_.get(), dims_.data(), nullptr), doing_);
  const std::size_t width = rank == 2 ? dims_[1] : 1;
  if (width * H5Tget_size(type_.get()) != row_bytes_)
    throw RecordError(doing_ + ": has the wrong number of values per row");
  rows_ = dims_[0];
  require_within_file(dataset_, rows_, row_bytes_, doing_);
  if (rows_ < kManyRows) return;
  const Handle list = own(H5Dget_create_plist(dataset_.get()), doing_);
  const Handle type = own(H5Dget_type(dataset_.get()), doing_);
  std::array<hsize_t, 2> chunk{0, 1};
  if (H5Pget_layout(list.get()) == H5D_CHUNKED && H5Pget_nfilters(list.get()) == 0 &&
      H5Tequal(type.get(), type_.get()) > 0 && H5Pget_chunk(list.get(), 2, chunk.data()) == rank && chunk[1] == width &&
      rows_ <= H5Dget_storage_size(dataset_.get()) / row_bytes_) {
    chunk_rows_ = chunk[0];
    for (hsize_t first = 0; first < rows_; first += chunk_rows_) {
      const std::array<hsize_t, 2> offset{first, 0};
      haddr_t& at = chunks_.emplace_back(HADDR_UNDEF);
      check(H5Dget_chunk_info_by_coord(dataset_.get(), offset.data(), nullptr, &at, nullptr), doing_);
    }
    descriptor_ = descriptor_of(own(H5Iget_file_id(dataset_.get()), doing_));
  }
}

void ColumnReader::read(std::uint64_t first, std::uint64_t count, void* rows) {
  fetch(first, count, rows);
  if (digest_) digest_->update({static_cast<const char*>(rows), count * row_bytes_});
}

void ColumnReader::fetch(std::uint64_t first, std::uint64_t count, void* rows) {
  if (count == 0) return;
  if (first + count > rows_) throw RecordError(doing_ + ": holds fewer rows than asked for");
  auto* to = static_cast<std::byte*>(rows);
  if (!chunks_.empty()) {
    // Without HDF5: it has one lock, for which threads would wait at each chunk.
    while (count > 0) {
      const std::uint64_t inside = first % chunk_rows_, n = std::min(count, chunk_rows_ - inside);
      const std::size_t bytes = n * row_bytes_;
      const auto at = static_cast<off_t>(chunks_[first / chunk_rows_] + inside * row_bytes_);
      if (::pread(descriptor_, to, bytes, at) != static_cast<ssize_t>(bytes))
        throw RecordError(doing_ + ": the file ends, or cannot be read, inside a chunk");
      to += bytes;
      first += n;
      count -= n;
    }
    return;
  }
  if (first == 0 && count == rows_) {  // without the cost of a selection
    check(H5Dread(dataset_.get(), type_.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, to), doing_);
    return;
  }
  const int rank = static_cast<int>(dims_.size());
  const std::array<hsize_t, 2> start{first, 0};
  const std::array<hsize_t, 2> block{count, rank == 2 ? dims_[1] : 1};
  check(H5Sselect_hyperslab(space_.get(), H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr), doing_);
  const Handle memory = own(H5Screate_simple(rank, block.data(), nullptr), doing_);
  check(H5Dread(dataset_.get(), type_.get(), memory.get(), space_.get(), H5P_DEFAULT, to), doing_);
}

std::uint32_t ColumnReader::crc() {
  const std::uint64_t block = std::min<std::uint64_t>(65536, rows_);
  std::vector<std::byte> rows(block * row_bytes_);
  std::uint32_t crc = 0;
  for (std::uint64_t at = 0; at < rows_; at += block) {
    const std::uint64_t n = std::min(block, rows_ - at);
    read(at, n, rows.data());
    crc = crc_32(crc, rows.data(), n * row_bytes_);
  }
  return crc;
}

void make_scale(const Handle& scale, const char* name, const std::vector<ScaleUse>& uses) {
  put_fixed_text(scale, "CLASS", "DIMENSION_SCALE");
  put_fixed_text(scale, "NAME", name);
  constexpr std::size_t kSize = sizeof(hobj_ref_t) + sizeof(std::uint32_t);
  const Handle type = own(H5Tcreate(H5T_COMPOUND, kSize), "reference list");
  check(H5Tinsert(type.get(), "dataset", 0, H5T_STD_REF_OBJ), "reference list");
  check(H5Tinsert(type.get(), "dimension", sizeof(hobj_ref_t), H5T_STD_U32LE), "reference list");
  std::vector<std::byte> list(kSize * uses.size());
  for (std::size_t i = 0; i < uses.size(); ++i) {
    const hobj_ref_t reference = reference_to(*uses[i].dataset);
    const std::uint32_t dimension = uses[i].dimension;
    std::memcpy(list.data() + i * kSize, &reference, sizeof reference);
    std::memcpy(list.data() + i * kSize + sizeof reference, &dimension, sizeof dimension);
  }
  put(scale, "REFERENCE_LIST", type.get(), type.get(), row_space(uses.size()), list.data());
}

void attach_scales(const Handle& dataset, const std::vector<const Handle*>& scales) {
  const Handle type = own(H5Tvlen_create(H5T_STD_REF_OBJ), "dimension list");
  std::vector<hobj_ref_t> references;
  for (const Handle* scale : scales) references.push_back(reference_to(*scale));
  std::vector<hvl_t> lists;
  for (hobj_ref_t& reference : references) lists.push_back({1, &reference});
  put(dataset, "DIMENSION_LIST", type.get(), type.get(), row_space(lists.size()), lists.data());
}

}  // namespace kphi::results::hdf5
