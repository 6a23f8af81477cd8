// libFuzzer: a small run file with bytes changed anywhere, or cut short, is read, verified or refused; HDF5 and what
// follows it neither crash nor take memory without bound. The input is a list of (place, byte).
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "base/error.hpp"
#include "results/run_reader.hpp"
#include "results/run_writer.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"

namespace {

const std::string& whole() {
  static const std::string bytes = [] {
    const kphi::test::TemporaryFolder folder;
    kphi::results::test::Truth truth;
    truth.speeds = {400};
    truth.zero_s = truth.dwell_s = 0.2;
    kphi::results::test::write_run(folder.path() / "a.h5", kphi::results::test::make_run(truth));
    return kphi::results::read_text(folder.path() / "a.h5");
  }();
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path path =
      std::filesystem::path("/dev/shm") / ("kphi_run_fuzz." + std::to_string(::getpid()) + ".h5");
  std::string bytes = whole();
  for (; size >= 4; data += 4, size -= 4) {
    std::uint32_t change = 0;
    std::memcpy(&change, data, 4);
    const std::size_t place = change >> 8;
    if (place < bytes.size()) bytes[place] = static_cast<char>(change);
    if (place == 0xFFFFFF) bytes.resize(bytes.size() / 2);
  }
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
  try {
    (void)kphi::results::verify_run(path);
    (void)kphi::results::read_run(path);
  } catch (const kphi::Error&) {
  }
  return 0;
}
