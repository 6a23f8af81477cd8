// A write that is cut short: what a folder's files would hold if only the beginning of it had reached the disk.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace kphi::soak {

/// Files are known by their inodes: a new name is no write.
class TornWrite {
 public:
  /// Remembers what all files in `folder` and below hold now.
  void before(const std::filesystem::path& folder);
  /// When exactly one file of `folder` was written into since then, `copy`, which is alike, gets the beginning of what
  /// changed in it, and of the rest what was there before. Does nothing when before() was not called.
  void tear(const std::filesystem::path& folder, const std::filesystem::path& copy, std::uint64_t seed) const;

 private:
  std::map<ino_t, std::string> held_;
};

}  // namespace kphi::soak
