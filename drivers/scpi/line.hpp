// A connection to a SCPI instrument: one line out, at most one line back. Blocking; one thread at a time.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace kphi::scpi {

/// None of these reaches the caller as an answer.
struct LineCounters {
  std::uint64_t queries = 0;
  std::uint64_t timeouts = 0;
  std::uint64_t damaged = 0;     ///< wrong tag, wrong header, too long
  std::uint64_t recoveries = 0;  ///< the line was restored: abort, clear, or a new connection
};

class Line {
 public:
  virtual ~Line() = default;
  /// Throws DeviceError: unplugged, no answer in time, malformed answer. After a failure the line recovers before the
  /// next call, so that a late answer never answers another query.
  virtual void write(std::string_view command) = 0;
  /// The answer without its end of line.
  [[nodiscard]] virtual std::string query(std::string_view command) = 0;
  [[nodiscard]] virtual const std::string& name() const noexcept = 0;
  [[nodiscard]] virtual LineCounters counters() const noexcept = 0;
};

}  // namespace kphi::scpi
