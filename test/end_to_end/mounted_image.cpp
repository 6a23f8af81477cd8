#include "test/end_to_end/mounted_image.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <system_error>
#include <thread>

#include "test/end_to_end/process.hpp"

namespace kphi::test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kImageBytes = 320u << 20;  // XFS makes none that is smaller than 300 MB; sparse
constexpr auto kPatience = std::chrono::seconds(30);

std::string cause() { return std::generic_category().message(errno); }

void expect_done(const std::vector<std::string>& command) {
  Process process(command);
  if (const int code = process.wait(); code != 0)
    throw MountError(fmt::format("{}: exit code {}: {}", command[0], code, process.err()));
}

}  // namespace

struct MountedImage::Traffic {
  std::uint64_t writes = 0, sectors = 0, in_flight = 0;
  friend bool operator==(const Traffic&, const Traffic&) = default;
};

void have_own_mounts() {
  if (::geteuid() != 0) throw MountError("only root may mount");
  if (::unshare(CLONE_NEWNS) != 0) throw MountError("no mounts of its own: " + cause());
  if (::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) throw MountError("private mounts: " + cause());
}

void make_file_system(const fs::path& image, const std::string& kind) {
  std::ofstream(image).close();
  fs::resize_file(image, kImageBytes);
  expect_done({"mkfs." + kind, "-q", image.string()});
}

MountedImage::MountedImage(const fs::path& image, const std::string& kind, const fs::path& at)
    : image_(image), at_(at) {
  fs::create_directories(at);
  // A copy of a mounted image bears the same UUID, which XFS minds.
  expect_done({"mount", "-o", kind == "xfs" ? "loop,nouuid" : "loop", image.string(), at.string()});
  struct stat status {};
  if (::stat(at.c_str(), &status) != 0) throw MountError(at.string() + ": " + cause());
  statistics_ = fmt::format("/sys/dev/block/{}:{}/stat", major(status.st_dev), minor(status.st_dev));
}

MountedImage::~MountedImage() {
  if (::umount2(at_.c_str(), 0) != 0) ::umount2(at_.c_str(), MNT_DETACH);
}

MountedImage::Traffic MountedImage::traffic() const {
  std::ifstream file(statistics_);
  std::array<std::uint64_t, 9> number{};
  for (std::uint64_t& n : number) file >> n;
  if (!file) throw MountError(statistics_.string() + ": cannot be read");
  return {number[4], number[6], number[8]};
}

std::uint64_t MountedImage::writes() const { return traffic().writes; }

void MountedImage::cut_power(const fs::path& copy) const {
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
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

}  // namespace kphi::test
