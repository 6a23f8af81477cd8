// What truly happened on the motor's line: against this a driver's account is held.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "drivers/sim/iq_faults.hpp"
#include "drivers/sim/wire_truth.hpp"

namespace kphi::sim {

/// One reply, as it was put on the wire.
struct SentIqReply {
  Instant asked{0};    ///< when the module read the question: the moment that the value is of
  Instant begun{0};    ///< when its first byte left
  Instant arrived{0};  ///< last byte of the first whole copy at the host
  std::uint8_t type = 0, sub = 0, id = 0, size = 0;
  std::array<std::uint8_t, 16> bytes{};
  double truth = std::numeric_limits<double>::quiet_NaN();  ///< what a perfect sensor would have said
  std::uint32_t done = 0;                                   ///< bit per MotorFaultKind that touched it
  std::uint32_t arrivals = 0;                               ///< copies that arrived byte for byte with a good checksum

  [[nodiscard]] std::span<const std::uint8_t> data() const noexcept { return std::span(bytes).first(size); }
};

struct IqTruth {
  std::uint64_t bytes_from_host = 0, bytes_to_module = 0;  ///< given to the line; heard by the module
  std::uint64_t bytes_from_module = 0, bytes_to_host = 0;
  std::uint64_t replies = 0;                           ///< that the module meant to send
  std::uint64_t frames_arrived = 0;                    ///< whole, with a good checksum, at the host; copies included
  std::uint64_t spoilt = 0;                            ///< copies of replies that do not arrive whole
  std::array<std::uint64_t, kMotorFaultKinds> done{};  ///< replies, bytes or events, by kind of fault
  std::vector<FaultEvent> events;
  std::vector<SentIqReply> log;  ///< in the order of sending; only if asked for
};

/// One JSON object per line: the events, the replies of the log, then {"motor_totals": …}.
[[nodiscard]] std::string json_lines(const IqTruth& truth);

}  // namespace kphi::sim
