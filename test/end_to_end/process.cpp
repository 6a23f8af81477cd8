#include "test/end_to_end/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <stdexcept>
#include <utility>

namespace kphi::test {
namespace {

using Clock = std::chrono::steady_clock;

std::string line_with(const std::string& printed, const std::string& text) {
  const std::size_t found = printed.find(text);
  if (found == std::string::npos) return {};
  const std::size_t end = printed.find('\n', found);
  if (end == std::string::npos) return {};
  const std::size_t begin = printed.rfind('\n', found) + 1;
  return printed.substr(begin, end - begin);
}

/// For execvpe(): the later of two settings of a variable counts for nobody, so that the earlier ones are left out.
std::vector<char*> environment_with(const std::vector<std::string>& further) {
  const auto name_of = [](const std::string& setting) { return setting.substr(0, setting.find('=') + 1); };
  std::vector<char*> settings;
  for (char** setting = environ; *setting != nullptr; ++setting) {
    const auto replaces = [&](const std::string& other) { return name_of(other) == name_of(*setting); };
    if (std::none_of(further.begin(), further.end(), replaces)) settings.push_back(*setting);
  }
  for (const std::string& setting : further) settings.push_back(const_cast<char*>(setting.c_str()));
  settings.push_back(nullptr);
  return settings;
}

bool may_set_real_time() {
  const pid_t trial = fork();
  if (trial == 0) {
    const sched_param priority{1};
    _exit(sched_setscheduler(0, SCHED_FIFO, &priority));
  }
  int status = 0;
  return trial > 0 && waitpid(trial, &status, 0) == trial && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

std::string kphi() { return kphi_is_of_another_build() ? std::getenv("KPHI_PROGRAM") : KPHI_PROGRAM; }

bool kphi_is_of_another_build() { return std::getenv("KPHI_PROGRAM") != nullptr; }

std::vector<std::string> in_real_time(std::vector<std::string> command, int priority) {
  static const bool may = may_set_real_time();
  if (may) command.insert(command.begin(), {"chrt", "-f", std::to_string(priority)});
  return command;
}

Process::Process(const std::vector<std::string>& arguments, const std::string& input,
                 const Surroundings& surroundings) {
  std::array<int, 2> in{}, out{}, err{};
  if (pipe2(in.data(), O_CLOEXEC) || pipe2(out.data(), O_CLOEXEC) || pipe2(err.data(), O_CLOEXEC)) {
    throw std::runtime_error("pipe");
  }
  // Whatever allocates comes before the fork: other threads may hold the heap's lock at that moment.
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const std::vector<char*> environment = environment_with(surroundings.environment);
  const sched_param priority{surroundings.fifo_priority};
  pid_ = fork();
  if (pid_ == 0) {
    dup2(surroundings.input < 0 ? in[0] : surroundings.input, 0);
    dup2(out[1], 1);
    dup2(err[1], 2);
    if (surroundings.fifo_priority > 0) sched_setscheduler(0, SCHED_FIFO, &priority);
    execvpe(argv[0], argv.data(), environment.data());
    _exit(127);
  }
  close(in[0]);
  close(out[1]);
  close(err[1]);
  out_descriptor_ = out[0];
  err_descriptor_ = err[0];
  if (!input.empty() && write(in[1], input.data(), input.size()) < 0) throw std::runtime_error("write to child");
  close(in[1]);
}

Process::~Process() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  close(out_descriptor_);
  close(err_descriptor_);
}

void Process::signal(int number) const { kill(pid_, number); }

bool Process::freeze() const {
  signal(SIGSTOP);
  siginfo_t state{};
  return waitid(P_PID, static_cast<id_t>(pid_), &state, WSTOPPED | WEXITED | WNOWAIT) == 0 &&
         state.si_code == CLD_STOPPED;
}

bool Process::is_real_time() const { return sched_getscheduler(pid_) == SCHED_FIFO; }

void Process::close_pipes() {
  for (int* descriptor : {&out_descriptor_, &err_descriptor_}) close(std::exchange(*descriptor, -1));
}

bool Process::read_some(std::chrono::milliseconds limit) {
  std::array<pollfd, 2> waiting{{{out_descriptor_, POLLIN, 0}, {err_descriptor_, POLLIN, 0}}};
  if (poll(waiting.data(), waiting.size(), static_cast<int>(limit.count())) <= 0) return true;
  const auto take = [](const pollfd& ready, int& descriptor, std::string& printed) {
    if (!ready.revents) return;
    std::array<char, 4096> buffer;
    const ssize_t n = read(descriptor, buffer.data(), buffer.size());
    if (n > 0) printed.append(buffer.data(), static_cast<std::size_t>(n));
    // A closed end would be ready for ever.
    if (n <= 0) close(std::exchange(descriptor, -1));
  };
  take(waiting[0], out_descriptor_, out_);
  take(waiting[1], err_descriptor_, err_);
  return out_descriptor_ >= 0 || err_descriptor_ >= 0;
}

std::string Process::everything() const { return "\n-- stdout\n" + out_ + "\n-- stderr\n" + err_; }

std::string Process::wait_for(const std::string& text, std::chrono::seconds limit) {
  const auto give_up = Clock::now() + limit;
  for (bool open = true;;) {
    for (const std::string* printed : {&out_, &err_}) {
      if (std::string line = line_with(*printed, text); !line.empty()) return line;
    }
    if (!open) throw std::runtime_error("the process ended without \"" + text + "\"" + everything());
    if (Clock::now() > give_up) throw std::runtime_error("\"" + text + "\" did not come" + everything());
    open = read_some(std::chrono::milliseconds(100));
  }
}

std::size_t Process::wait_for_prompt(const std::vector<std::string>& texts, std::chrono::seconds limit) {
  const auto give_up = Clock::now() + limit;
  for (;;) {
    std::size_t first = std::string::npos, which = 0;
    for (std::size_t i = 0; i < texts.size(); ++i)
      if (const std::size_t at = err_.find(texts[i], prompted_); at < first) first = at, which = i;
    if (first != std::string::npos) {
      prompted_ = first + texts[which].size();
      return which;
    }
    if (Clock::now() > give_up || !read_some(std::chrono::milliseconds(100)))
      throw std::runtime_error("\"" + texts.front() + "\" was not asked" + everything());
  }
}

int Process::wait(std::chrono::seconds limit) {
  // What steps back behind all others takes its time: ctest says when it is too long.
  if (std::getenv("KPHI_POLITE") != nullptr) limit = std::max<std::chrono::seconds>(limit, std::chrono::hours(1));
  for (const auto give_up = Clock::now() + limit; read_some(std::chrono::milliseconds(50));) {
    if (Clock::now() > give_up) throw std::runtime_error("the process does not end" + everything());
    // A grandchild may hold the pipes open: the end of the process itself is what counts.
    if (waitpid(pid_, &status_, WNOHANG) == pid_) {
      while (read_some(std::chrono::milliseconds(0)) && Clock::now() < give_up) {
        pollfd ready[2] = {{out_descriptor_, POLLIN, 0}, {err_descriptor_, POLLIN, 0}};
        if (poll(ready, 2, 0) <= 0) break;
      }
      pid_ = -1;
      break;
    }
  }
  if (pid_ > 0) {
    waitpid(pid_, &status_, 0);
    pid_ = -1;
  }
  return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
}

}  // namespace kphi::test
