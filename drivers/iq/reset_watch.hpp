// Whether the module has restarted by itself: its uptime goes backwards, or fault_ever gains the under-voltage bit.
// A restart loses every volatile setting, the communication timeout first of all.
#pragma once

#include <optional>
#include <string>

#include "drivers/iq/exchange.hpp"
#include "drivers/iq/identity.hpp"

namespace kphi::iq {

class ResetWatch {
 public:
  void begin(const Identity& identity) noexcept;
  /// The next uptime may be anything, and so may fault_ever: one of them is being set.
  void expect_new_time() noexcept { uptime_.reset(); }
  /// What gave the restart away; nothing if there was none.
  [[nodiscard]] std::optional<std::string> take(const Heard& heard);

 private:
  std::optional<double> uptime_;  ///< seconds of the module
  int faults_ = 0;                ///< bits that were there before
};

}  // namespace kphi::iq
