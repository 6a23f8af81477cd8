// What a command takes.
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <vector>

namespace kphi::bench {

struct Cost {
  double wall_s = 0, cpu_s = 0;
  double memory_mb = 0;  ///< the most that was resident
  int code = 0;
};

/// Runs `command`, with its output into the file `out`.
inline Cost cost_of(const std::string& out, const std::vector<std::string>& command) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const auto begun = std::chrono::steady_clock::now();
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
    ::execv(arguments.front(), arguments.data());
    ::_exit(127);
  }
  int status = 0;
  rusage used{};
  ::wait4(child, &status, 0, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count(),
          seconds(used.ru_utime) + seconds(used.ru_stime), 1.024e-3 * static_cast<double>(used.ru_maxrss),
          WIFEXITED(status) ? WEXITSTATUS(status) : -1};
}

}  // namespace kphi::bench
