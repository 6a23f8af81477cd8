// A disk that counts its operations and can refuse them.
#pragma once

#include <cerrno>
#include <functional>
#include <set>
#include <system_error>

#include "results/file_layer.hpp"
#include "test/soak/campaign_mixture.hpp"

namespace kphi::soak {

class SpoiltDisk final : public results::FileLayer {
 public:
  explicit SpoiltDisk(const std::optional<DiskRefusal>& refusal) : refusal_(refusal) {}

  void before_write(std::uint64_t) override { operate(); }
  void reserve(int descriptor, std::uint64_t offset, std::uint64_t bytes) override {
    operate();
    FileLayer::reserve(descriptor, offset, bytes);
  }
  void sync_data(int descriptor) override {
    operate();
    secured_.insert(std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor)));
  }
  bool sync_folder(const std::filesystem::path&) override {
    operate();
    return true;
  }
  void rename(const std::filesystem::path& from, const std::filesystem::path& to) override {
    operate();
    FileLayer::rename(from, to);
  }
  void replace(const std::filesystem::path& from, const std::filesystem::path& to) override {
    operate();
    FileLayer::replace(from, to);
  }
  std::uint64_t free_bytes(const std::filesystem::path& folder) override {
    operate();
    return FileLayer::free_bytes(folder);
  }

  /// Called before each operation with its number, from 1.
  std::function<void(std::uint64_t)> watch = [](std::uint64_t) {};
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }
  /// Files whose content has been secured once at least.
  [[nodiscard]] const std::set<std::filesystem::path>& secured() const noexcept { return secured_; }

 private:
  void operate() {
    watch(++operations_);
    if (!refusal_ || operations_ < refusal_->from) return;
    if (refusal_->operations > 0 && operations_ >= refusal_->from + refusal_->operations) return;
    ++refused_;
    throw std::system_error(ENOSPC, std::generic_category());
  }

  const std::optional<DiskRefusal> refusal_;
  std::uint64_t operations_ = 0, refused_ = 0;
  std::set<std::filesystem::path> secured_;
};

}  // namespace kphi::soak
