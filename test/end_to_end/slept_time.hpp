// For how long the computer of a program under sleeping_clock.cpp has slept: a file that both see.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace kphi::test {

class SleptTime {
 public:
  /// Makes `file`, which lives as long as its folder. Nothing has slept yet.
  explicit SleptTime(std::string file) : file_(std::move(file)) {
    const int descriptor = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    void* page = MAP_FAILED;
    if (descriptor >= 0 && ftruncate(descriptor, sizeof(Nanoseconds)) == 0)
      page = mmap(nullptr, sizeof(Nanoseconds), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    if (descriptor >= 0) close(descriptor);
    if (page == MAP_FAILED) throw std::runtime_error("cannot share " + file_);
    slept_ = static_cast<Nanoseconds*>(page);
  }
  ~SleptTime() { munmap(slept_, sizeof(Nanoseconds)); }
  SleptTime(const SleptTime&) = delete;
  SleptTime& operator=(const SleptTime&) = delete;

  /// While the program stands still: it never sees its monotonic clock jump.
  void add(std::chrono::nanoseconds slept) { *slept_ += slept.count(); }
  /// Of a program that is to have these clocks.
  [[nodiscard]] std::vector<std::string> environment() const {
    return {"LD_PRELOAD=" KPHI_SLEEPING_CLOCK, "KPHI_SLEPT=" + file_};
  }

 private:
  using Nanoseconds = std::atomic<std::int64_t>;
  std::string file_;
  Nanoseconds* slept_ = nullptr;
};

}  // namespace kphi::test
