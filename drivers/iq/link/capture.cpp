#include "drivers/iq/link/capture.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "base/error.hpp"
#include "base/thread.hpp"

namespace kphi::iq {
namespace {

constexpr char kTitle[] = "kphi iq capture 1\n";
constexpr std::size_t kRecordHead = 13;
constexpr auto kBatch = std::chrono::milliseconds(50);

void append(std::vector<std::uint8_t>& to, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

/// What a full disk does not take is lost; the line goes on.
void write_all(int fd, std::span<const std::uint8_t> bytes) noexcept {
  while (!bytes.empty()) {
    const auto n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

/// What is not a capture is not replaced by one.
bool is_capture_or_nothing(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::exists(path, none) || std::filesystem::file_size(path, none) == 0) return true;
  std::string title(sizeof kTitle - 1, '\0');
  std::ifstream(path, std::ios::binary).read(title.data(), static_cast<std::streamsize>(title.size()));
  return title == kTitle;
}

}  // namespace

Capture::Capture(const std::string& path) {
  if (!is_capture_or_nothing(path))
    throw DeviceError("capture " + path, "create", "another file has this name", "choose another file");
  file_ = Descriptor(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (file_.number() < 0) throw DeviceError("capture " + path, "create", std::strerror(errno), "choose another file");
  waiting_.assign(kTitle, kTitle + sizeof kTitle - 1);
  writer_ = start_thread({"motor capture"}, [this] { run(); });
}

Capture::~Capture() {
  {
    const std::lock_guard lock(mutex_);
    hand_over();
    ended_ = true;
  }
  news_.notify_one();
  writer_.join();
}

void Capture::add(Direction direction, std::span<const std::uint8_t> bytes, Instant time) {
  if (queued_ + collected_.size() + bytes.size() + 2 * kRecordHead > kMostWaiting) {
    gap_ = true;
  } else {
    if (std::exchange(gap_, false)) put(Direction::missing, {}, time);
    put(direction, bytes, time);
  }
  {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    hand_over();
  }
  news_.notify_one();
}

void Capture::put(Direction direction, std::span<const std::uint8_t> bytes, Instant time) {
  collected_.push_back(static_cast<std::uint8_t>(direction));
  append(collected_, static_cast<std::uint64_t>(time.count()), 8);
  append(collected_, bytes.size(), 4);
  collected_.insert(collected_.end(), bytes.begin(), bytes.end());
}

void Capture::hand_over() {
  waiting_.insert(waiting_.end(), collected_.begin(), collected_.end());
  collected_.clear();
  queued_ = waiting_.size();
}

void Capture::run() noexcept {
  std::vector<std::uint8_t> batch;
  for (bool last = false; !last;) {
    {
      std::unique_lock lock(mutex_);
      news_.wait(lock, [&] { return ended_ || !waiting_.empty(); });
      news_.wait_for(lock, kBatch, [&] { return ended_; });
      last = ended_;
      batch.clear();
      batch.swap(waiting_);
    }
    write_all(file_.number(), batch);
  }
}

}  // namespace kphi::iq
