// A child process whose output is read as it comes.
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace kphi::test {

/// What a child has otherwise than this program.
struct Surroundings {
  std::vector<std::string> environment;  ///< further "NAME=value"
  int input = -1;                        ///< descriptor of standard input; -1: what is handed to the child
  int fifo_priority = 0;  ///< of SCHED_FIFO; 0: none. A child that is refused it goes on without: see is_real_time()
};

/// The program under test: that of this build, or what KPHI_PROGRAM names, such as a sanitizer's.
[[nodiscard]] std::string kphi();
[[nodiscard]] bool kphi_is_of_another_build();

class Process {
 public:
  /// Starts `arguments[0]`; standard input is `input`, then closed.
  explicit Process(const std::vector<std::string>& arguments, const std::string& input = {},
                   const Surroundings& surroundings = {});
  /// Kills and waits.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Waits until a whole line that contains `text` came on stdout or stderr; returns it. Throws after `limit`, or when
  /// the process ends without it, with all that was printed.
  std::string wait_for(const std::string& text, std::chrono::seconds limit = std::chrono::seconds(60));
  /// Waits until one of the texts came on stderr after the one of the last call, whether or not its line has ended;
  /// which one.
  std::size_t wait_for_prompt(const std::vector<std::string>& texts = {"to stop: "},
                              std::chrono::seconds limit = std::chrono::seconds(60));
  void signal(int number) const;
  /// Stops it, and returns when all of it stands still; false: it has ended before.
  [[nodiscard]] bool freeze() const;
  [[nodiscard]] bool is_real_time() const;
  /// Reads what is printed, and returns as soon as something was, or after `limit`; false: it has closed both ends.
  bool hear(std::chrono::milliseconds limit = {}) { return read_some(limit); }
  [[nodiscard]] int pid() const { return pid_; }
  /// Nobody listens any more: what it prints from now on meets a closed pipe.
  void close_pipes();
  /// Waits for the end; returns the exit code, or 128 + signal. Throws after `limit`.
  int wait(std::chrono::seconds limit = std::chrono::seconds(120));
  [[nodiscard]] const std::string& out() const { return out_; }
  [[nodiscard]] const std::string& err() const { return err_; }

 private:
  bool read_some(std::chrono::milliseconds limit);
  [[nodiscard]] std::string everything() const;

  int pid_ = -1;
  int status_ = 0;
  int out_descriptor_ = -1;
  int err_descriptor_ = -1;
  std::string out_;
  std::string err_;
  std::size_t prompted_ = 0;  ///< of err_: up to there prompts have been waited for
};

/// The command at a real-time priority of 1 to 99, where this process may grant one: other work of the host then does
/// not delay it, just as it would not delay a device or the only program of a bench's computer.
[[nodiscard]] std::vector<std::string> in_real_time(std::vector<std::string> command, int priority = 10);

}  // namespace kphi::test
