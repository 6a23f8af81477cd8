// What truly happened on the load cell's wire: against this a driver's account is held.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/sim/netbox_device.hpp"

namespace kphi::sim {

/// One datagram of whole records that the box sent to the host.
struct SentDatagram {
  std::uint32_t boot = 0, stream = 0;  ///< see Datagram
  std::uint32_t first_rdt = 0, first_ft = 0, last_ft = 0;
  std::uint32_t records = 0;
  std::uint32_t samples = 0;  ///< fewer than records when the measurement stood still
  Instant sent{0};
  std::uint32_t arrivals = 0;  ///< 0: lost
  Instant first_arrival{0};
  std::uint64_t arrival_place = 0;  ///< of the first: how many datagrams had arrived before
  std::size_t first_sample = 0;     ///< into WireTruth::sampled
};

/// What a script made happen, when.
struct FaultEvent {
  Instant at{0};
  std::string what;
};

struct WireTruth {
  // Datagrams to the host; records where it says so.
  std::uint64_t sent = 0, records_sent = 0;
  std::uint64_t arrived = 0, records_arrived = 0;  ///< copies of duplicates included
  std::uint64_t dropped = 0, records_dropped = 0;
  std::uint64_t duplicated = 0, records_duplicated = 0;  ///< copies beyond the first that arrived
  std::uint64_t overtaken = 0;                           ///< held back so that younger ones arrived before
  std::uint64_t delayed = 0;
  std::uint64_t malformed = 0;         ///< of wrong size, arrived
  std::uint64_t foreign = 0;           ///< from another address, arrived
  std::uint64_t records_left_out = 0;  ///< of short blocks; never sent
  std::uint64_t to_others = 0, records_to_others = 0;
  // Requests.
  std::uint64_t starts = 0;  ///< that the host sent
  std::uint64_t starts_lost = 0, starts_doubled = 0, starts_delayed = 0;
  std::uint64_t unheard = 0;  ///< requests of any kind while the box was dead
  // The box.
  std::uint64_t thefts = 0, restarts = 0, reboots = 0, stalls = 0, jumps = 0, overruns = 0, rate_changes = 0, moves = 0;
  // Answers over stream sockets that a fault spoilt.
  std::uint64_t http_spoilt = 0, tcp_spoilt = 0;

  std::vector<FaultEvent> events;
  std::vector<SentDatagram> log;  ///< in the order of sending; only if asked for
  // Of each record in `log`; only if asked for.
  std::vector<Instant> sampled;   ///< true sample time
  std::vector<std::uint32_t> ft;  ///< ft_sequence as sent
};

/// One JSON object per line: the events, the datagrams of the log, then {"totals": …}.
[[nodiscard]] std::string json_lines(const WireTruth& truth);

/// The totals that are not zero, in one line: "sent 700, records_sent 28000, …".
[[nodiscard]] std::string summary(const WireTruth& truth);

}  // namespace kphi::sim
