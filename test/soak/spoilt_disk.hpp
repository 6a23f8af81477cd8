// A disk that counts its operations and can refuse them.
#pragma once

#include <functional>
#include <set>

#include "results/file_layer.hpp"
#include "test/soak/campaign_mixture.hpp"

namespace kphi::soak {

class SpoiltDisk final : public results::FileLayer {
 public:
  explicit SpoiltDisk(const std::optional<DiskRefusal>& refusal) : refusal_(refusal) {}

  void before_write(std::uint64_t bytes) override;
  void reserve(int descriptor, std::uint64_t offset, std::uint64_t bytes) override;
  void sync_data(int descriptor) override;
  void sync_folder(const std::filesystem::path& folder) override;
  void rename(const std::filesystem::path& from, const std::filesystem::path& to) override;
  void replace(const std::filesystem::path& from, const std::filesystem::path& to) override;
  std::uint64_t free_bytes(const std::filesystem::path& folder) override;

  /// Called before each operation with its number, from 1.
  std::function<void(std::uint64_t)> watch = [](std::uint64_t) {};
  [[nodiscard]] std::uint64_t operations() const noexcept { return operations_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }
  /// Files whose content has been secured once at least.
  [[nodiscard]] const std::set<std::filesystem::path>& secured() const noexcept { return secured_; }

 private:
  void operate();

  const std::optional<DiskRefusal> refusal_;
  std::uint64_t operations_ = 0, refused_ = 0;
  std::set<std::filesystem::path> secured_;
};

}  // namespace kphi::soak
