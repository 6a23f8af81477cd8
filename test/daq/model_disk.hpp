// A disk that loses what was not synced. It stands between a campaign and the real file system, and can say at any of
// the campaign's file operations what a kill (everything written is there) or a power cut would leave.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <system_error>

#include "results/file_layer.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::test {

class ModelDisk final : public results::FileLayer {
 public:
  /// `before(n)`: called before the n-th operation, from 0; what it throws is what the disk refuses.
  explicit ModelDisk(std::function<void(int)> before) : before_(std::move(before)) {}

  void before_write(std::uint64_t) override { next(); }
  void reserve(int descriptor, std::uint64_t offset, std::uint64_t bytes) override {
    next();
    FileLayer::reserve(descriptor, offset, bytes);
  }
  void sync_data(int descriptor) override {
    next();
    if (forgets_syncs) return;
    struct stat status {};
    if (::fstat(descriptor, &status) != 0) throw std::system_error(errno, std::generic_category());
    std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
    const int fd = ::open(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0 || ::pread(fd, bytes.data(), bytes.size(), 0) != status.st_size)
      throw std::system_error(errno, std::generic_category());
    ::close(fd);
    shared(status.st_ino)->bytes = std::move(bytes);
  }
  bool sync_folder(const std::filesystem::path& folder) override {
    next();
    durable_[folder.string()] = entries(folder);
    return true;
  }
  void rename(const std::filesystem::path& from, const std::filesystem::path& to) override {
    next();
    FileLayer::rename(from, to);
  }
  void replace(const std::filesystem::path& from, const std::filesystem::path& to) override {
    next();
    if (struct stat status{}; ::stat(to.c_str(), &status) == 0) live_.erase(status.st_ino);  // its number is free now
    FileLayer::replace(from, to);
  }

  [[nodiscard]] int operations() const { return operations_; }
  /// As a program that never syncs its files: shows that the model loses what it should.
  bool forgets_syncs = false;

  /// What a power cut leaves of `folder`, as new files in `image`: of each folder the entries as last synced or as they
  /// are now, of each file page by page what was last synced or what is there now, by the lot of `seed`.
  void cut_power(const std::filesystem::path& folder, const std::filesystem::path& image, unsigned seed) {
    std::mt19937 random(seed);
    std::filesystem::create_directories(image);
    const bool now = random() % 2 == 0;
    const Names& names = now ? entries(folder) : durable_[folder.string()];
    for (const auto& [name, inode] : names) write(folder, *inode, image / name, random);
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.is_directory()) cut_power(entry.path(), image / entry.path().filename(), seed * 31 + 7);
    }
  }

 private:
  struct Inode {
    std::string bytes;  ///< as last synced
  };
  using Names = std::map<std::string, std::shared_ptr<Inode>>;

  void next() { before_(operations_++); }
  std::shared_ptr<Inode> shared(ino_t number) {
    auto& inode = live_[number];
    if (!inode) inode = std::make_shared<Inode>();
    return inode;
  }
  Names entries(const std::filesystem::path& folder) {
    Names names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      struct stat status {};
      if (entry.is_regular_file() && ::stat(entry.path().c_str(), &status) == 0)
        names[entry.path().filename().string()] = shared(status.st_ino);
    }
    return names;
  }
  /// The file that now bears the inode, if one does.
  std::string present_bytes(const std::filesystem::path& folder, const Inode& inode) {
    for (const auto& [name, other] : entries(folder)) {
      if (other.get() == &inode) return bytes_of(folder / name);
    }
    return inode.bytes;
  }
  void write(const std::filesystem::path& folder, const Inode& inode, const std::filesystem::path& to,
             std::mt19937& random) {
    constexpr std::size_t kPage = 4096;
    const std::string present = present_bytes(folder, inode);
    std::string bytes = inode.bytes;
    bytes.resize(random() % 2 == 0 ? inode.bytes.size() : present.size(), '\0');
    for (std::size_t at = 0; at < bytes.size(); at += kPage) {
      const std::size_t n = std::min(kPage, bytes.size() - at);
      if (random() % 2 == 0 && at + n <= present.size()) present.copy(bytes.data() + at, n, at);
    }
    std::ofstream(to, std::ios::binary) << bytes;
  }

  std::function<void(int)> before_;
  int operations_ = 0;
  std::map<ino_t, std::shared_ptr<Inode>> live_;
  std::map<std::string, Names> durable_;  ///< by folder
};

}  // namespace kphi::test
