// File operations of a record that a disk may refuse: reserve, sync, rename. Tests pass a layer that refuses, the
// deterministic bench one that does not wait for the disk. Beside it, text files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "base/descriptor.hpp"
#include "base/error.hpp"
#include "base/text.hpp"

namespace kphi::results {

/// The disk as it is. Members may be called from any thread; failures throw std::system_error with the errno.
class FileLayer {
 public:
  virtual ~FileLayer() = default;
  /// Called before `bytes` go to a file; throws to refuse them.
  virtual void before_write(std::uint64_t bytes);
  /// Reserves disk blocks for `bytes` from `offset` on without making the file longer, if the file system can.
  virtual void reserve(int descriptor, std::uint64_t offset, std::uint64_t bytes);
  /// fdatasync.
  virtual void sync_data(int descriptor);
  /// fsync of the folder: makes new and renamed files in it durable. False: this file system knows no such thing.
  virtual bool sync_folder(const std::filesystem::path& folder);
  /// Takes everybody's right to write. False: this file system keeps no such rights.
  virtual bool make_read_only(const std::filesystem::path& file);
  /// Throws EEXIST if `to` exists.
  virtual void rename(const std::filesystem::path& from, const std::filesystem::path& to);
  /// Replaces `to` atomically.
  virtual void replace(const std::filesystem::path& from, const std::filesystem::path& to);
  /// Bytes an unprivileged process may still write there (statvfs).
  [[nodiscard]] virtual std::uint64_t free_bytes(const std::filesystem::path& folder);
};

/// Does not wait for the disk: for files that nobody needs after a power cut.
class MemoryOnlySync final : public FileLayer {
 public:
  void sync_data(int descriptor) override;
  bool sync_folder(const std::filesystem::path& folder) override;
};

/// The one FileLayer of the process.
[[nodiscard]] FileLayer& disk();

/// "disk full: <where>: …" for an errno that means no room, "<where>: …" else.
[[nodiscard]] std::string failure_text(const std::string& where, int error);

/// Runs `action`; what the system refuses becomes a RecordError.
template <class Action>
auto on_disk(const std::string& where, Action&& action) {
  try {
    return action();
  } catch (const std::system_error& error) {
    throw RecordError(failure_text(where, error.code().value()));
  }
}

/// Runs `read`; what a text file refuses (base/text.hpp) becomes a RecordError that names it.
template <class Read>
auto reading(const std::filesystem::path& path, Read&& read) {
  try {
    return read();
  } catch (const std::runtime_error& error) {
    throw RecordError(path.string() + ": " + error.what());
  }
}

/// Throws RecordError unless `folder` has room for `bytes`; the message names both and the folder.
void require_room(const std::filesystem::path& folder, std::uint64_t bytes, FileLayer& files = disk());

/// The first free of name+ending, name-2+ending, name-3+ending …
[[nodiscard]] std::filesystem::path free_name(const std::string& name, const std::string& ending);

/// Writes all of `text`. Throws std::system_error.
void write_all(int descriptor, std::string_view text);

/// What a file system answers to an order that it does not know: exFAT, CIFS, FUSE. Not of a disk that fails.
[[nodiscard]] bool is_unknown_there(int error) noexcept;

/// Syncs a closed file. Throws std::system_error.
void sync_file(const std::filesystem::path& path, FileLayer& files);

/// A file written piece by piece to `path`.part, which replaces `path` when it is complete and synced. Not finished, it
/// goes, and `path` is as it was. Throws RecordError.
class ReplacedFile {
 public:
  explicit ReplacedFile(std::filesystem::path path, FileLayer& files = disk());
  ReplacedFile(const ReplacedFile&) = delete;
  ReplacedFile& operator=(const ReplacedFile&) = delete;
  ~ReplacedFile();
  void append(std::string_view text);
  void finish();

 private:
  std::filesystem::path path_, part_;
  FileLayer& files_;
  Descriptor descriptor_;
  bool finished_ = false;
};

/// All of a ReplacedFile at once.
void write_text(const std::filesystem::path& path, const std::string& text, FileLayer& files = disk());

/// Of a table or a journal that kphi writes; of a log that is imported.
inline constexpr std::size_t kLargestTable = std::size_t{64} << 20, kLargestLog = std::size_t{4} << 30;

/// The file's bytes, `most_bytes` at most. Throws RecordError for a longer file, a pipe, a device or a folder.
[[nodiscard]] std::string read_text(const std::filesystem::path& path, std::size_t most_bytes = kLargestTable);

}  // namespace kphi::results
