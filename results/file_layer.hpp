// The few operations of a record on a disk that can be refused: room, sync, rename. A test hands in a layer that
// refuses, the deterministic bench one that does not wait for the disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace kphi::results {

/// The disk as it is. Members may be called from any thread; failures throw std::system_error with the errno.
class FileLayer {
 public:
  virtual ~FileLayer() = default;
  /// Called before `bytes` go to a file; throws to refuse them.
  virtual void before_write(std::uint64_t bytes);
  /// Gives `bytes` from `offset` on a place on the disk without making the file longer, where the file system can.
  virtual void reserve(int descriptor, std::uint64_t offset, std::uint64_t bytes);
  /// fdatasync.
  virtual void sync_data(int descriptor);
  /// fsync of the folder: makes a creation or a renaming in it last.
  virtual void sync_folder(const std::filesystem::path& folder);
  /// Never replaces an existing `to`: that throws with EEXIST.
  virtual void rename(const std::filesystem::path& from, const std::filesystem::path& to);
  /// Replaces `to` in one step.
  virtual void replace(const std::filesystem::path& from, const std::filesystem::path& to);
  /// Bytes an unprivileged process may still write there (statvfs).
  [[nodiscard]] virtual std::uint64_t free_bytes(const std::filesystem::path& folder);
};

/// As FileLayer, but waits for no disk: for files that nobody misses after a power cut.
class MemoryOnlySync final : public FileLayer {
 public:
  void sync_data(int descriptor) override;
  void sync_folder(const std::filesystem::path& folder) override;
};

/// The one FileLayer of the process.
[[nodiscard]] FileLayer& disk();

/// Throws RecordError unless `folder` has room for `bytes`; the message names both and the folder.
void require_room(const std::filesystem::path& folder, std::uint64_t bytes, FileLayer& files = disk());

/// The first free of name+ending, name-2+ending, name-3+ending …
[[nodiscard]] std::filesystem::path free_name(const std::string& name, const std::string& ending);

/// Makes the bytes of a closed file last. Throws std::system_error.
void sync_file(const std::filesystem::path& path, FileLayer& files);

/// Writes `text` beside `path`, syncs it and puts it in the place of `path` in one step. Throws RecordError.
void write_text(const std::filesystem::path& path, const std::string& text, FileLayer& files = disk());

/// The file's bytes. Throws RecordError.
[[nodiscard]] std::string read_text(const std::filesystem::path& path);

/// "disk full: <where>: …" for an errno that means no room, "<where>: …" else.
[[nodiscard]] std::string failure_text(const std::string& where, int error);

}  // namespace kphi::results
