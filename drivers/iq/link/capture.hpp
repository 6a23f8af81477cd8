// Every byte of a line, with its time and direction, in a file: shows what really went over the wire.
//
// The file: the line "kphi iq capture 1", then records without gaps: one byte '<' (received) or '>' (sent) or '!'
// (something is missing here), the bench time in ns (int64), the number of bytes (uint32), the bytes; little-endian.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "base/clock.hpp"
#include "base/descriptor.hpp"

namespace kphi::iq {

/// Writes in a thread of its own: a slow disk never delays the line. Bytes that it cannot take are marked as missing.
class Capture {
 public:
  enum class Direction : char { came = '<', sent = '>', missing = '!' };

  /// Throws DeviceError when the file cannot be written.
  explicit Capture(const std::string& path);
  ~Capture();

  /// From one thread; waits for no disk and no other thread.
  void add(Direction direction, std::span<const std::uint8_t> bytes, Instant time);

 private:
  friend struct LockOfCapture;  // of a test that stands still in it
  static constexpr std::size_t kMostWaiting = 4 << 20;
  void run() noexcept;
  void put(Direction direction, std::span<const std::uint8_t> bytes, Instant time);
  /// Under the lock.
  void hand_over();

  Descriptor file_;
  // The line's thread.
  std::vector<std::uint8_t> collected_;
  std::size_t queued_ = 0;  ///< bytes of waiting_, as last seen
  bool gap_ = false;

  std::mutex mutex_;  ///< the line's thread and the writer: the rest
  std::condition_variable news_;
  std::vector<std::uint8_t> waiting_;
  bool ended_ = false;
  std::thread writer_;
};

}  // namespace kphi::iq
