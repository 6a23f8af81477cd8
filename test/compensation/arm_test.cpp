// The library on a microcontroller: compiled in float for a Cortex-M4F and an M7, and its instructions counted under
// qemu.
#include <gmock/gmock.h>

#include <filesystem>
#include <map>
#include <sstream>

#include "test/end_to_end/process.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::test::arm_test {

struct Processor {
  const char* name;
  const char* board;
};
void PrintTo(const Processor& processor, std::ostream* out) { *out << processor.name; }

bool installed(const char* program) {
  std::istringstream folders(std::getenv("PATH") != nullptr ? std::getenv("PATH") : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (std::filesystem::exists(std::filesystem::path(folder) / program)) return true;
  }
  return false;
}

std::string output_of(const std::vector<std::string>& command) {
  Process process(command);
  const int code = process.wait();
  EXPECT_EQ(code, 0) << process.out() << process.err();
  return process.out() + process.err();  // qemu hands on what a program says on stderr
}

class OnArm : public testing::TestWithParam<Processor> {
 protected:
  void SetUp() override {
    for (const char* program : {"arm-none-eabi-g++", "qemu-system-arm"}) {
      if (!installed(program)) GTEST_SKIP() << "needs " << program << ": `./run peers` installs it";
    }
  }
  void build(const char* type) {
    const std::string source = source_dir();
    output_of({"cmake", "-S", source + "/test/compensation/arm", "-B", built(), "-G", "Ninja",
               "-DCMAKE_TOOLCHAIN_FILE=" + source + "/test/compensation/arm/toolchain.cmake",
               std::string("-DCPU=") + GetParam().name, std::string("-DCMAKE_BUILD_TYPE=") + type,
               "-DLIBRARY=" + source + "/compensation"});
    output_of({"cmake", "--build", built(), "--parallel", "1"});
  }
  [[nodiscard]] std::string built() const { return (folder / "build").string(); }

  TemporaryFolder folder;
};

TEST_P(OnArm, CallsTakeAsManyInstructionsAsPromised) {
  build("Release");
  std::istringstream lines(output_of({"qemu-system-arm", "-M", GetParam().board, "-nographic", "-semihosting",
                                      "-icount", "shift=0", "-kernel", built() + "/counts"}));
  std::map<std::string, int> counts;
  std::string name;
  for (int count = 0; lines >> name >> count;) {
    counts[name] = count;
    RecordProperty(name, count);
  }
  ASSERT_NEAR(counts["thousand_of_nothing"], 1000, 2);
  EXPECT_GT(counts["set_arms_o"], 1000) << "too few to be the call at all";
  EXPECT_LE(counts["set_arms_o"], 8000);
  EXPECT_LE(counts["set_arms_x"], 800);
  EXPECT_GT(counts["mix_and_speeds_for"], 500);
  EXPECT_LE(counts["mix_and_speeds_for"], 1500);
  EXPECT_LE(counts["layout"] + counts["set_layout"], 4500);
  EXPECT_LE(counts["mix_short_of_all"], 20'000);
}

TEST_P(OnArm, NoArithmeticInDoubleIsLeftAndTheCodeIsSmall) {
  build("MinSizeRel");
  const std::string archive = built() + "/library/libkphi_compensation.a";
  EXPECT_THAT(output_of({"arm-none-eabi-nm", archive}), testing::Not(testing::HasSubstr("__aeabi_d")));
  // What the flight calls link, without the mathematics library.
  std::istringstream symbols(output_of({"arm-none-eabi-nm", "-S", built() + "/counts"}));
  std::map<std::string, long> sizes;  // by address: constructors have two names
  for (std::string line; std::getline(symbols, line);) {
    std::istringstream fields(line);
    std::string address, size, kind, symbol;
    if (!(fields >> address >> size >> kind >> symbol) || symbol.find("kphi12compensation") == std::string::npos)
      continue;
    if (kind == "t" || kind == "T" || kind == "w" || kind == "W") sizes[address] = std::stol(size, nullptr, 16);
  }
  long code = 0;
  for (const auto& [address, size] : sizes) code += size;
  RecordProperty("code_bytes", static_cast<int>(code));
  EXPECT_GT(code, 5'000);
  EXPECT_LE(code, 12'500) << "bytes";
}

INSTANTIATE_TEST_SUITE_P(Processors, OnArm,
                         testing::Values(Processor{"cortex-m4", "mps2-an386"}, Processor{"cortex-m7", "mps2-an500"}),
                         [](const auto& one) { return one.param.name == std::string("cortex-m4") ? "M4F" : "M7"; });

}  // namespace kphi::test::arm_test
