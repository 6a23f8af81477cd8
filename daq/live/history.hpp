// What a page that comes late must know.
#pragma once

#include <deque>
#include <string>

#include "daq/live/messages.hpp"

namespace kphi::daq::live {

/// Bounded; one thread.
class History {
 public:
  static constexpr std::size_t kTraceLength = 2000, kMostSteps = 20000, kMostLines = 500;

  /// A message that all pages have been sent. Of limits the newest counts.
  void keep(const std::string& message);
  /// A point of the trace, unless that of this time is there already.
  void keep(const Tick& tick);
  /// {"type":"history","trace":[[time_s, thrust_n, commanded_rpm, speed_rpm] …],"messages":[…]}; null for what is not
  /// known. Limits first, then steps, then all else, each oldest first.
  [[nodiscard]] std::string message() const;

 private:
  struct Point {
    double time_s, thrust_n, commanded_rpm, speed_rpm;
  };
  std::deque<Point> trace_;
  std::deque<std::string> limits_, steps_, others_;
};

}  // namespace kphi::daq::live
