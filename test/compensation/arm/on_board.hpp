// The library built for a microcontroller as firmware would build it, run under qemu, counted and weighed.
#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "test/end_to_end/process.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::test {

struct Processor {
  const char* name;   ///< as gcc calls it
  const char* board;  ///< as qemu calls it
  const char* said;   ///< as README.md calls it
};
inline constexpr Processor kM4f{"cortex-m4", "mps2-an386", "M4F"}, kM7{"cortex-m7", "mps2-an500", "M7"};

/// What the library may take in a build, of which the first is the one to fly.
struct Build {
  const char* type;  ///< of CMake's
  int code, set_arms_o, mix_and_speeds_for, longest_search;
};
inline constexpr Build kBuilds[] = {{"MinSizeRel", 14'000, 3'200, 1'500, 25'000},
                                    {"RelWithDebInfo", 16'500, 3'200, 1'500, 22'000},
                                    {"Release", 33'000, 3'200, 1'500, 22'000}};
/// In every one of them, for four rotors as for eight [bytes].
inline constexpr int kStack = 1024, kCompensatorBytes = 2048;

/// What it takes: the columns of the table in compensation/README.md. Code, memory and stack in bytes, then
/// instructions.
enum Column { kCode, kKept, kDeepest, kSetArmsInO, kMixAndSpeeds, kLongest, kLongestCurved };
using Figures = std::array<int, 7>;

/// As a row of that table begins.
inline std::string beginning_of_row(const Processor& processor, const Build& build) {
  return std::string("| ") + processor.said + " | `" + build.type + "` |";
}

inline std::string row_of(const Processor& processor, const Build& build, const Figures& figures) {
  std::string row = beginning_of_row(processor, build);
  for (const int figure : figures) {
    std::string digits = std::to_string(figure);
    if (digits.size() > 3) digits.insert(digits.size() - 3, ",");
    row += " " + digits + " |";
  }
  return row;
}

/// What the page tells. Throws if it has no such row.
inline Figures figures_told(const Processor& processor, const Build& build) {
  std::ifstream page(source_dir() + "/compensation/README.md");
  const std::string beginning = beginning_of_row(processor, build);
  for (std::string line; std::getline(page, line);) {
    if (line.rfind(beginning, 0) != 0) continue;
    line.erase(std::remove(line.begin(), line.end(), ','), line.end());
    std::istringstream fields(line.substr(beginning.size()));
    Figures figures{};
    char bar = 0;
    for (int& figure : figures) fields >> figure >> bar;
    if (fields) return figures;
  }
  throw std::runtime_error("compensation/README.md has no row " + beginning);
}

/// What is missing to build and run; empty: nothing.
inline std::string missing_for_boards() {
  const char* path = std::getenv("PATH");
  for (const char* program : {"arm-none-eabi-g++", "qemu-system-arm"}) {
    std::istringstream folders(path != nullptr ? path : "");
    bool found = false;
    for (std::string folder; std::getline(folders, folder, ':');)
      found = found || std::filesystem::exists(std::filesystem::path(folder) / program);
    if (!found) return std::string("needs ") + program + ": `./run peers` installs it";
  }
  return "";
}

class OnBoard {
 public:
  /// `type`: of CMake's builds, such as Release. Throws what the build says if it fails.
  OnBoard(const Processor& processor, const std::string& type, bool in_float = true, int demands = 1000)
      : processor_(processor) {
    const std::string source = source_dir();
    (void)output_of({"cmake", "-S", source + "/test/compensation/arm", "-B", built(), "-G", "Ninja",
                     "-DCMAKE_TOOLCHAIN_FILE=" + source + "/test/compensation/arm/toolchain.cmake",
                     std::string("-DCPU=") + processor.name, "-DCMAKE_BUILD_TYPE=" + type,
                     "-DLIBRARY=" + source + "/compensation", "-DDEMANDS=" + std::to_string(demands),
                     std::string("-DKPHI_COMPENSATION_FLOAT=") + (in_float ? "ON" : "OFF")});
    (void)output_of({"cmake", "--build", built(), "--parallel", "1"});
  }

  /// Each number that counts.cpp tells: instructions of calls, bytes of stacks and of what is kept.
  [[nodiscard]] std::map<std::string, int> counts() const {
    std::istringstream lines(output_of({"qemu-system-arm", "-M", processor_.board, "-nographic", "-semihosting",
                                        "-icount", "shift=0", "-kernel", built() + "/counts"}));
    std::map<std::string, int> counts;
    std::string name;
    for (int count = 0; lines >> name >> count;) counts[name] = count;
    return counts;
  }
  [[nodiscard]] static Figures figures_of(const std::map<std::string, int>& counts, long code_bytes) {
    int deepest = 0;
    for (const auto& [name, count] : counts) {
      if (name.rfind("stack_", 0) == 0) deepest = std::max(deepest, count);
    }
    return {static_cast<int>(code_bytes),
            counts.at("bytes_compensator") + counts.at("bytes_mixer"),
            deepest,
            counts.at("set_arms_o"),
            counts.at("mix_and_speeds_for"),
            counts.at("longest_search"),
            counts.at("longest_search_curved")};
  }
  /// What the classes' calls link of the library: its code without its C interface and the compiler's mathematics.
  [[nodiscard]] long code_bytes() const {
    std::istringstream symbols(output_of({"arm-none-eabi-nm", "-S", built() + "/flight"}));
    std::map<std::string, long> sizes;  // by address: constructors have two names
    for (std::string line; std::getline(symbols, line);) {
      std::istringstream fields(line);
      std::string address, size, kind, symbol;
      if (!(fields >> address >> size >> kind >> symbol) || symbol.find("kphi12compensation") == std::string::npos)
        continue;
      if (std::string("tTwW").find(kind) != std::string::npos) sizes[address] = std::stol(size, nullptr, 16);
    }
    long code = 0;
    for (const auto& [address, size] : sizes) code += size;
    return code;
  }
  /// All names in the archive.
  [[nodiscard]] std::string names() const {
    return output_of({"arm-none-eabi-nm", built() + "/library/libkphi_compensation.a"});
  }

 private:
  [[nodiscard]] std::string built() const { return (folder_ / "build").string(); }
  /// Of both streams: qemu hands on what a program says on stderr.
  static std::string output_of(const std::vector<std::string>& command) {
    Process process(command);
    const int code = process.wait();
    if (code != 0)
      throw std::runtime_error(command[0] + " ended with " + std::to_string(code) + ":\n" + process.out() +
                               process.err());
    return process.out() + process.err();
  }

  Processor processor_;
  TemporaryFolder folder_;
};

}  // namespace kphi::test
