// A lock between programs: flock(2) on a file that names the holder. The kernel releases it when the holder ends,
// however that happens, so a file left behind does not block anybody.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "base/descriptor.hpp"

namespace kphi::results {

/// The holder of a lock, as its file names it.
struct LockHolder {
  int pid = 0;  ///< 0: unknown
  std::string command;
  std::string since_utc;  ///< ISO 8601, Z
  /// "process 4711 (kphi run …) since 2021-05-30T08:00:00Z"
  [[nodiscard]] std::string words() const;
};

class FileLock {
 public:
  /// Takes the lock at `path`, also in another user's file. nullopt: taken; `holder` names the other program. On a file
  /// system without locks, one that does not hold(). Throws RecordError if the file cannot be opened.
  [[nodiscard]] static std::optional<FileLock> take(const std::filesystem::path& path, LockHolder& holder);
  /// False: this file system gives no locks, and another program could have it, too.
  [[nodiscard]] bool holds() const noexcept { return holds_; }
  FileLock(FileLock&&) = default;
  FileLock& operator=(FileLock&&) = delete;
  /// Removes the file, then releases the lock.
  ~FileLock();

 private:
  FileLock(std::filesystem::path path, Descriptor file, bool holds)
      : path_(std::move(path)), file_(std::move(file)), holds_(holds) {}
  std::filesystem::path path_;
  Descriptor file_;
  bool holds_;
};

}  // namespace kphi::results
