// A small process beside this one that does nothing but wait for its end. If it ends without having said so, killed or
// crashed, the sentinel says the last words to the devices: the supply's output goes off, the box stops its stream. The
// motor needs none: its module coasts by itself once nobody commands it.
#pragma once

#include <sys/types.h>

#include <vector>

#include "base/descriptor.hpp"
#include "base/last_word.hpp"

namespace kphi::daq {

class Sentinel {
 public:
  /// Starts kphi-sentinel, which lies beside this program or in PATH. Throws DeviceError.
  explicit Sentinel(const std::vector<LastWord>& words);
  /// Releases it: nothing is said.
  ~Sentinel();
  Sentinel(const Sentinel&) = delete;
  Sentinel& operator=(const Sentinel&) = delete;
  [[nodiscard]] pid_t process() const { return process_; }

 private:
  Descriptor line_;
  pid_t process_ = -1;
};

}  // namespace kphi::daq
