// A write that is cut short: what a folder's files would hold if only the beginning of it had reached the disk.
#pragma once

#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <vector>

#include "results/file_layer.hpp"
#include "test/dice.hpp"

namespace kphi::soak {

inline ino_t inode_of(const std::filesystem::path& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 ? status.st_ino : 0;
}

/// Up to somewhere within what differs it is `now`, from there on `then`.
inline std::string mixed(const std::string& then, const std::string& now, test::Dice& dice) {
  const auto first =
      static_cast<std::size_t>(std::mismatch(now.begin(), now.end(), then.begin(), then.end()).first - now.begin());
  std::size_t last = std::max(now.size(), then.size());
  if (now.size() == then.size())
    while (last > first + 1 && now[last - 1] == then[last - 1]) --last;
  const std::size_t cut = first + static_cast<std::size_t>(dice.whole(0, static_cast<int>(last - first)));
  return now.substr(0, cut) + (cut < then.size() ? then.substr(cut) : "");
}

/// Files are known by their inodes: a new name is no write.
class TornWrite {
 public:
  /// Remembers what all files in `folder` and below hold now.
  void before(const std::filesystem::path& folder) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
      if (entry.is_regular_file()) held_[inode_of(entry.path())] = results::read_text(entry.path());
  }
  /// When exactly one file of `folder` was written into since then, `copy`, which is alike, gets the beginning of what
  /// changed in it, and of the rest what was there before. Does nothing when before() was not called.
  void tear(const std::filesystem::path& folder, const std::filesystem::path& copy, std::uint64_t seed) const {
    if (held_.empty()) return;
    struct Written {
      std::filesystem::path name;
      std::string then, now;
    };
    std::vector<Written> written;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      const auto held = held_.find(inode_of(entry.path()));
      Written file{std::filesystem::relative(entry.path(), folder), held == held_.end() ? "" : held->second,
                   results::read_text(entry.path())};
      if (file.then != file.now) written.push_back(std::move(file));
    }
    if (written.size() != 1) return;
    test::Dice dice(seed);
    const std::filesystem::path torn = copy / written.front().name;
    std::filesystem::remove(torn);  // it may be read-only
    std::ofstream(torn, std::ios::binary) << mixed(written.front().then, written.front().now, dice);
  }

 private:
  std::map<ino_t, std::string> held_;
};

}  // namespace kphi::soak
