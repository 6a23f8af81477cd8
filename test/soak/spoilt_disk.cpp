#include "test/soak/spoilt_disk.hpp"

#include <cerrno>
#include <string>
#include <system_error>

namespace kphi::soak {

void SpoiltDisk::operate() {
  watch(++operations_);
  if (!refusal_ || operations_ < refusal_->from) return;
  if (refusal_->operations > 0 && operations_ >= refusal_->from + refusal_->operations) return;
  ++refused_;
  throw std::system_error(ENOSPC, std::generic_category());
}

void SpoiltDisk::before_write(std::uint64_t) { operate(); }

void SpoiltDisk::reserve(int descriptor, std::uint64_t offset, std::uint64_t bytes) {
  operate();
  FileLayer::reserve(descriptor, offset, bytes);
}

void SpoiltDisk::sync_data(int descriptor) {
  operate();
  secured_.insert(std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor)));
}

void SpoiltDisk::sync_folder(const std::filesystem::path&) { operate(); }

void SpoiltDisk::rename(const std::filesystem::path& from, const std::filesystem::path& to) {
  operate();
  FileLayer::rename(from, to);
}

void SpoiltDisk::replace(const std::filesystem::path& from, const std::filesystem::path& to) {
  operate();
  FileLayer::replace(from, to);
}

std::uint64_t SpoiltDisk::free_bytes(const std::filesystem::path& folder) {
  operate();
  return FileLayer::free_bytes(folder);
}

}  // namespace kphi::soak
