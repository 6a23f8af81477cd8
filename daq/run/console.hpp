// What a run says, written by a thread of its own: a terminal that is stopped (Ctrl-S, a stalled ssh), or a pipe that
// nobody reads, blocks nobody but itself.
//
// The thread blocks all signals and writes only where poll() sees room, little at a time. A terminal can have less room
// than that, hence it is opened a second time, so as not to block; if it cannot be (it belongs to another user), the
// thread may come to sit in write() until the terminal goes on. Nobody waits for it then, nor at the end of the
// program.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "daq/run/word_queue.hpp"

namespace kphi::daq {

class Console {
 public:
  Console();
  /// Gives up what waits. A write under way is waited for at most kGiveUp, then left behind.
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  /// How long the end of the program waits for a terminal.
  static constexpr std::chrono::milliseconds kGiveUp{1000};

  /// Any thread; returns at once. What `descriptor` refuses (its reader is gone, the disk is full) is lost in silence.
  void put(int descriptor, std::string text, Worth worth) noexcept;
  /// Waits until everything is written; false: not within `limit`.
  bool finish(std::chrono::milliseconds limit) noexcept;
  /// Something was put.
  [[nodiscard]] bool is_used() const noexcept;
  /// Kept texts that were dropped for want of room.
  [[nodiscard]] std::uint64_t lost() const noexcept;

 private:
  struct Shared;
  static void write_on(const std::shared_ptr<Shared>& shared) noexcept;
  std::shared_ptr<Shared> shared_;  ///< with the thread, which may outlive this
};

/// That of the program; never destroyed, since its thread may sit in write() when the program ends.
[[nodiscard]] Console& console() noexcept;

/// On stdout and stderr by way of console(); on any other stream at once, in the caller's thread. A reader that is gone
/// or does not read is no reason to stop a run.
void put(std::FILE* stream, const std::string& text, Worth worth = Worth::kept) noexcept;

}  // namespace kphi::daq
