// What a page that joins late must know.
#pragma once

#include <deque>
#include <string>

#include "daq/live/messages.hpp"

namespace kphi::daq::live {

/// Bounded; one thread.
class History {
 public:
  static constexpr std::size_t kTraceLength = 2000, kMostSteps = 20000, kMostLines = 500;

  /// A message that was sent to all pages. Only the newest limits are kept.
  void keep(const Message& message);
  /// A point of the trace, unless it has one of this time.
  void keep(const Tick& tick);
  /// {"type":"history","trace":[[time_s, thrust_n, commanded_rpm, speed_rpm] …],"messages":[…]}; null if unknown.
  /// Limits first, then steps, then the others, each oldest first.
  [[nodiscard]] std::string message() const;

 private:
  struct Point {
    double time_s, thrust_n, commanded_rpm, speed_rpm;
  };
  std::deque<Point> trace_;
  std::deque<std::string> limits_, steps_, others_;
};

}  // namespace kphi::daq::live
