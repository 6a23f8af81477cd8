// Programs that read what we wrote and know nothing of us. A test skips, saying so, where one is absent.
#pragma once

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

namespace kphi::test {

struct Reading {
  int status = -1;
  std::string out;
};

/// Runs `command` in a shell; stdout and stderr together.
[[nodiscard]] inline Reading read_with(const std::string& command) {
  Reading reading;
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return reading;
  std::array<char, 4096> buffer{};
  for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;)
    reading.out.append(buffer.data(), n);
  reading.status = ::pclose(pipe);
  return reading;
}

[[nodiscard]] inline bool works(const std::string& command) { return read_with(command).status == 0; }

inline void write_file(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace kphi::test
