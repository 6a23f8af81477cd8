// A small process beside this one that does nothing but wait for its end. If it ends without having said so, killed or
// crashed, the sentinel says the last words to the devices: the supply's output goes off, the box stops its stream. The
// motor needs none: its module coasts by itself once nobody commands it.
//
// A thread asks it twice a second whether it is there. One that was killed or stopped is replaced at once; if that
// fails, nothing may turn and nobody may be asked to come near.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/descriptor.hpp"
#include "base/last_word.hpp"

namespace kphi::daq {

class Sentinel {
 public:
  /// Starts kphi-sentinel, which lies beside this program or in PATH, and waits until it says that it watches. Throws
  /// DeviceError.
  explicit Sentinel(const std::vector<LastWord>& words);
  /// Releases it: nothing is said. Takes a few seconds at most.
  ~Sentinel();
  Sentinel(const Sentinel&) = delete;
  Sentinel& operator=(const Sentinel&) = delete;
  /// Thread-safe, as are the other members.
  [[nodiscard]] pid_t process() const noexcept { return process_; }
  /// Why there is none; empty: one watches. Waits for no thread, nor does take_news.
  [[nodiscard]] std::string failure() const;
  /// One line for each that was replaced since the last call.
  [[nodiscard]] std::vector<std::string> take_news();

 private:
  void start();
  void end() noexcept;
  // The thread.
  void watch() noexcept;
  /// Empty, or why it does not watch.
  [[nodiscard]] std::string ask();
  void replace(const std::string& why);

  const std::vector<std::string> arguments_;
  Descriptor line_;
  std::atomic<pid_t> process_{-1};
  int replaced_ = 0;

  mutable std::mutex mutex_;  ///< of the next two
  std::string failure_;
  std::vector<std::string> news_;
  std::atomic<bool> has_failed_{false};

  Wakeup quit_;
  std::thread thread_;  ///< last: it uses the members above
};

}  // namespace kphi::daq
