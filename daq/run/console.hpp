// Output of a run, written by a thread of its own: a stopped terminal (Ctrl-S, a stalled ssh) or a full pipe blocks
// only that thread.
//
// The thread blocks all signals and writes a little at a time, only where poll() sees room. A terminal can have less
// room than that, so it is opened a second time, non-blocking; if that fails (it belongs to another user), the thread
// may hang in write() until the terminal continues. Nothing waits for it then, not even the end of the program.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <list>
#include <memory>
#include <string>
#include <string_view>

namespace kphi::daq {

/// What happens to a text when there is no room for all.
enum class Worth : std::uint8_t {
  kept,     ///< dropped last, and counted
  passing,  ///< dropped first, the oldest before the others
  live,     ///< as passing; also replaces a live text right before it of which nothing was written yet
};

class WordQueue {
 public:
  static constexpr std::size_t kRoom = std::size_t{256} * 1024;  ///< bytes

  /// A text longer than kRoom is accepted and drops all others. `order` must grow.
  void push(std::string text, Worth worth, std::uint64_t order);
  [[nodiscard]] bool empty() const noexcept { return texts_.empty(); }
  /// Order of the oldest text. Must not be empty.
  [[nodiscard]] std::uint64_t order() const noexcept { return texts_.front().order; }
  /// At most `most` bytes of the oldest text. Must not be empty. Valid until taken() or clear(), also after push().
  [[nodiscard]] std::string_view begin(std::size_t most);
  /// `n` of the bytes that begin() returned were written.
  void taken(std::size_t n) noexcept;
  /// Drops everything, uncounted.
  void clear() noexcept;

 private:
  struct Text {
    std::string bytes;
    Worth worth = Worth::kept;
    std::uint64_t order = 0;
  };
  [[nodiscard]] std::list<Text>::iterator first_whole() noexcept;
  bool drop_one() noexcept;

  std::list<Text> texts_;
  std::size_t size_ = 0;      ///< bytes of all
  std::size_t gone_ = 0;      ///< bytes of the oldest that were written
  bool is_begun_ = false;     ///< the oldest may be partly written
  std::uint64_t untold_ = 0;  ///< lost texts before the oldest one that the output does not mention yet
};

class Console {
 public:
  Console();
  /// Drops what waits. Waits at most kGiveUp for a write under way, then leaves it behind.
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  /// How long the end of the program waits for a terminal.
  static constexpr std::chrono::milliseconds kGiveUp{1000};

  /// Thread-safe; returns at once. Text that `descriptor` refuses (its reader is gone, the disk is full) is dropped.
  void put(int descriptor, std::string text, Worth worth) noexcept;
  /// Waits until everything is written; false: not within `limit`.
  bool finish(std::chrono::milliseconds limit) noexcept;
  /// put() was called.
  [[nodiscard]] bool is_used() const noexcept;

 private:
  struct Shared;
  static void write_on(const std::shared_ptr<Shared>& shared) noexcept;
  std::shared_ptr<Shared> shared_;  ///< with the thread, which may live longer
};

/// The program's console; never destroyed, since its thread may hang in write() when the program ends.
[[nodiscard]] Console& console() noexcept;

/// Through console() for stdout and stderr; any other stream is written at once, in the caller's thread. A reader that
/// is gone or does not read never stops a run.
void put(std::FILE* stream, const std::string& text, Worth worth = Worth::kept) noexcept;

}  // namespace kphi::daq
