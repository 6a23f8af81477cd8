// A lock between programs: flock(2) on a file that says who holds it. It goes with its holder, however that ends, so a
// file left behind by a dead one is no obstacle.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace kphi::results {

/// Who holds a lock, as far as its file tells.
struct LockHolder {
  int pid = 0;  ///< 0: not told
  std::string command;
  std::string since_utc;  ///< ISO 8601, Z
  /// "process 4711 (kphi run …) since 2021-05-30T08:00:00Z"
  [[nodiscard]] std::string words() const;
};

class FileLock {
 public:
  /// Takes the lock at `path`, or tells who holds it in `holder`. Another user's file is good, too. A file system that
  /// knows no locks gives none, and none is missed. Throws RecordError when the file cannot be opened.
  [[nodiscard]] static std::optional<FileLock> take(const std::filesystem::path& path, LockHolder& holder);
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;
  /// Gives it back and removes the file.
  ~FileLock();

 private:
  FileLock(std::filesystem::path path, int descriptor) : path_(std::move(path)), descriptor_(descriptor) {}
  std::filesystem::path path_;
  int descriptor_ = -1;
};

}  // namespace kphi::results
