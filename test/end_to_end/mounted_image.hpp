// A file system in a file, mounted through a loop device. For root on Linux; what is missing is told by MountError.
#pragma once

#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <thread>

#undef major  // of sys/sysmacros.h
#undef minor

#include "test/end_to_end/program.hpp"

namespace kphi::test {

class MountError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr std::uint64_t kImageBytes = 320u << 20;  // XFS makes none that is smaller than 300 MB; sparse
inline constexpr auto kImagePatience = std::chrono::seconds(30);

inline std::string cause() { return std::generic_category().message(errno); }

inline void expect_done(const std::vector<std::string>& command) {
  Process process(command);
  if (const int code = process.wait(); code != 0)
    throw MountError(fmt::format("{}: exit code {}: {}", command[0], code, process.err()));
}

/// From here on this process and its children have mounts of their own, which are gone with the last of them, however
/// they end. Throws MountError.
inline void have_own_mounts() {
  if (::geteuid() != 0) throw MountError("only root may mount");
  if (::unshare(CLONE_NEWNS) != 0) throw MountError("no mounts of its own: " + cause());
  if (::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) throw MountError("private mounts: " + cause());
}

/// Makes an empty file system of `kind` ("ext4") with the defaults of its mkfs. Throws MountError.
inline void make_file_system(const std::filesystem::path& image, const std::string& kind) {
  std::ofstream(image).close();
  std::filesystem::resize_file(image, kImageBytes);
  expect_done({"mkfs." + kind, "-q", image.string()});
}

class MountedImage {
 public:
  /// Mounts `image`, of that kind, at the folder `at`, with the defaults of its kind: what its journal holds is
  /// replayed. Throws MountError.
  MountedImage(const std::filesystem::path& image, const std::string& kind, const std::filesystem::path& at)
      : image_(image), at_(at) {
    std::filesystem::create_directories(at);
    // A copy of a mounted image bears the same UUID, which XFS minds.
    expect_done({"mount", "-o", kind == "xfs" ? "loop,nouuid" : "loop", image.string(), at.string()});
    struct stat status {};
    if (::stat(at.c_str(), &status) != 0) throw MountError(at.string() + ": " + cause());
    statistics_ = fmt::format("/sys/dev/block/{}:{}/stat", gnu_dev_major(status.st_dev), gnu_dev_minor(status.st_dev));
  }
  ~MountedImage() {
    if (::umount2(at_.c_str(), 0) != 0) ::umount2(at_.c_str(), MNT_DETACH);
  }
  MountedImage(const MountedImage&) = delete;
  MountedImage& operator=(const MountedImage&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return at_; }
  /// Write requests that the device has ended so far.
  [[nodiscard]] std::uint64_t writes() const { return traffic().writes; }
  /// What the device holds at one moment, as a power cut would leave it: all that was written to it and nothing of what
  /// the kernel still keeps in memory. A copy during which the device was written to is made again.
  void cut_power(const std::filesystem::path& copy) const {
    const auto give_up = std::chrono::steady_clock::now() + kImagePatience;
    while (std::chrono::steady_clock::now() < give_up) {
      const Traffic before = traffic();
      if (before.in_flight > 0) {
        std::this_thread::yield();
        continue;
      }
      expect_done({"cp", "--sparse=always", image_.string(), copy.string()});
      if (traffic() == before) return;
    }
    throw MountError(image_.string() + ": is written to without a pause");
  }

 private:
  struct Traffic {
    std::uint64_t writes = 0, sectors = 0, in_flight = 0;
    friend bool operator==(const Traffic&, const Traffic&) = default;
  };
  [[nodiscard]] Traffic traffic() const {
    std::ifstream file(statistics_);
    std::array<std::uint64_t, 9> number{};
    for (std::uint64_t& n : number) file >> n;
    if (!file) throw MountError(statistics_.string() + ": cannot be read");
    return {number[4], number[6], number[8]};
  }

  const std::filesystem::path image_, at_;
  std::filesystem::path statistics_;  ///< of its device
};

}  // namespace kphi::test
