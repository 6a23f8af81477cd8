// Detects that the module has restarted by itself: its uptime goes backwards, or fault_ever gains the under-voltage
// bit. A restart loses every volatile setting, the communication timeout first of all.
#pragma once

#include <optional>
#include <string>

#include "drivers/iq/exchange/exchange.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

class ResetWatch {
 public:
  void begin(const Identity& identity) noexcept;
  /// One of the two entries is being set: accepts any next value.
  void expect_new_time() noexcept { uptime_.reset(); }
  /// The evidence of a restart; nullopt: no restart.
  [[nodiscard]] std::optional<std::string> take(const QueryResult& result);

 private:
  std::optional<double> uptime_;  ///< seconds of the module
  int faults_ = 0;                ///< bits that were there before
};

}  // namespace kphi::iq
