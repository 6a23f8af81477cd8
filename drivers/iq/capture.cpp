#include "drivers/iq/capture.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

#include "drivers/device_error.hpp"

namespace kphi::iq {
namespace {

constexpr char kTitle[] = "kphi iq capture 1\n";
constexpr std::size_t kTitleSize = sizeof kTitle - 1;
constexpr std::size_t kRecordHead = 13;
constexpr auto kBatch = std::chrono::milliseconds(50);

[[noreturn]] void refuse(const std::string& path, const char* operation, const std::string& why) {
  throw DeviceError("capture " + path, operation, why, "choose another file");
}

void append(std::vector<std::uint8_t>& to, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::uint64_t little(const char* at, int bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < bytes; ++i) value |= std::uint64_t{static_cast<std::uint8_t>(at[i])} << (8 * i);
  return value;
}

bool write_all(int fd, std::span<const std::uint8_t> bytes) noexcept {
  while (!bytes.empty()) {
    const auto n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return true;
}

}  // namespace

Capture::Capture(const std::string& path) : fd_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
  if (fd_ < 0) refuse(path, "create", std::strerror(errno));
  waiting_.assign(kTitle, kTitle + kTitleSize);
  writer_ = std::thread([this] { run(); });
}

Capture::~Capture() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  news_.notify_one();
  writer_.join();
  ::close(fd_);
}

void Capture::add(Direction direction, std::span<const std::uint8_t> bytes, Instant time) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() + bytes.size() + 2 * kRecordHead > kMostWaiting) {
      missing_bytes_ += bytes.size();
      gap_ = true;
      return;
    }
    if (std::exchange(gap_, false)) put(Direction::missing, {}, time);
    put(direction, bytes, time);
  }
  news_.notify_one();
}

void Capture::put(Direction direction, std::span<const std::uint8_t> bytes, Instant time) {
  waiting_.push_back(static_cast<std::uint8_t>(direction));
  append(waiting_, static_cast<std::uint64_t>(time.count()), 8);
  append(waiting_, bytes.size(), 4);
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
}

void Capture::run() noexcept {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
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
    if (!write_all(fd_, batch)) missing_bytes_ += batch.size();
  }
}

std::vector<Captured> read_capture(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file || text.compare(0, kTitleSize, kTitle) != 0) refuse(path, "read", "it is no capture");
  std::vector<Captured> records;
  for (std::size_t at = kTitleSize; at + kRecordHead <= text.size();) {
    const std::size_t size = little(&text[at + 9], 4);
    if (text.size() - at - kRecordHead < size) break;
    const char* data = text.data() + at + kRecordHead;
    records.push_back({static_cast<Capture::Direction>(text[at]),
                       Instant(static_cast<std::int64_t>(little(&text[at + 1], 8))),
                       {data, data + size}});
    at += kRecordHead + size;
  }
  return records;
}

}  // namespace kphi::iq
