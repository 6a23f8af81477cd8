// A file system in a file, mounted through a loop device. For root on Linux; what is missing is told by MountError.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace kphi::test {

class MountError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// From here on this process and its children have mounts of their own, which are gone with the last of them, however
/// they end. Throws MountError.
void have_own_mounts();

/// Makes an empty file system of `kind` ("ext4") with the defaults of its mkfs. Throws MountError.
void make_file_system(const std::filesystem::path& image, const std::string& kind);

class MountedImage {
 public:
  /// Mounts `image`, of that kind, at the folder `at`, with the defaults of its kind: what its journal holds is
  /// replayed. Throws MountError.
  MountedImage(const std::filesystem::path& image, const std::string& kind, const std::filesystem::path& at);
  ~MountedImage();
  MountedImage(const MountedImage&) = delete;
  MountedImage& operator=(const MountedImage&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return at_; }
  /// Write requests that the device has ended so far.
  [[nodiscard]] std::uint64_t writes() const;
  /// What the device holds at one moment, as a power cut would leave it: all that was written to it and nothing of what
  /// the kernel still keeps in memory. A copy during which the device was written to is made again.
  void cut_power(const std::filesystem::path& copy) const;

 private:
  struct Traffic;
  [[nodiscard]] Traffic traffic() const;

  const std::filesystem::path image_, at_;
  std::filesystem::path statistics_;  ///< of its device
};

}  // namespace kphi::test
