// The wire between the simulated box and its clients, with the faults of a script: virtual time, seeded, no I/O. With
// the same seed, script and inputs the same bytes arrive at the same times, however often it is asked.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim/netbox/device.hpp"
#include "drivers/sim/script/faults.hpp"
#include "drivers/sim/script/script_run.hpp"
#include "drivers/sim/transport/conversations.hpp"

namespace kphi::sim {

/// The client that takes streams over; what the box sends to it is not delivered.
inline constexpr Peer kHijacker = ~Peer{0};

/// One datagram of whole records that the box sent to the host.
struct SentDatagram {
  std::uint32_t boot = 0, stream = 0;  ///< see Datagram
  std::uint32_t first_rdt = 0, first_ft = 0, last_ft = 0;
  std::uint32_t records = 0;
  std::uint32_t samples = 0;  ///< fewer than records when the measurement stood still
  Instant sent{0};
  std::uint32_t arrivals = 0;  ///< 0: lost
  Instant first_arrival{0};
  std::size_t first_sample = 0;  ///< into WireTruth::sampled
};

/// What truly happened on the load cell's wire: a driver's own counts are checked against it.
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
  std::uint64_t starts = 0;                 ///< that the host sent
  std::uint64_t unheard = 0;                ///< requests of any kind while the box was dead
  std::uint64_t restarts = 0, reboots = 0;  ///< of the box

  /// By kind, but for those of datagrams: how often it has begun, or met a request or an answer.
  std::map<FaultKind, std::uint64_t> done;
  std::vector<FaultEvent> events;
  std::vector<SentDatagram> log;  ///< in the order of sending; only if asked for
  // Of each record in `log`; only if asked for.
  std::vector<Instant> sampled;   ///< true sample time
  std::vector<std::uint32_t> ft;  ///< ft_sequence as sent
};

/// What a fault of the web server, and no other, does to an answer (web.cpp).
void spoil_page(const Fault& fault, StreamReply& reply);

class FaultInjector {
 public:
  /// How much truth is kept beside the totals.
  enum class Keep : std::uint8_t { totals, datagrams, samples };
  /// `box` must outlive this. Faults act in the order of the script.
  FaultInjector(NetBoxDevice& box, FaultScript script, std::uint64_t seed, Keep keep = Keep::totals);
  FaultInjector(const FaultInjector&) = delete;
  FaultInjector& operator=(const FaultInjector&) = delete;

  /// One tick of the bench: what NetBoxDevice::sample takes, here by the box's own, perhaps skewed, clock.
  void sample(const LoadCellSample& sample) {
    if (sample.at >= next_event_) [[unlikely]]
      meet_events(sample.at);
    if (disturbed_) [[unlikely]]
      return sample_disturbed(sample);
    box_.sample(sample);
  }
  /// A datagram to the box's RDT port, sent at `now` to the address that the box has then.
  void request(std::span<const std::uint8_t> datagram, Peer peer, Instant now);
  /// Next datagram that has arrived until `now`; `out.at` is the time of its arrival.
  bool next_datagram(Datagram& out, Instant now);
  /// Earliest arrival of a datagram in flight; kNever: none.
  [[nodiscard]] Instant next_arrival() const noexcept;

  /// Answer to one complete request; bench times.
  [[nodiscard]] StreamReply http(std::string_view request, Instant now);
  /// The web server's port is closed now.
  [[nodiscard]] bool http_refused(Instant now) const noexcept;
  /// As NetBoxDevice::tcp; an empty reply when `received` holds no whole command.
  [[nodiscard]] StreamReply tcp(std::string& received, Instant now);
  /// Address that a fault gave the box, and from which it sends; empty: its own.
  [[nodiscard]] const std::string& moved_to() const noexcept { return moved_to_; }
  [[nodiscard]] const WireTruth& truth() const noexcept { return truth_; }

 private:
  struct Progress {
    std::uint64_t burst_left = 0;  ///< of a loss
    bool bad = false;              ///< Gilbert-Elliott
  };
  struct InFlightDatagram {
    Datagram datagram;
    std::size_t entry = 0;  ///< in the log
    bool whole = true;      ///< records of the box, not made up
    bool copy = false;
  };
  struct Held {
    InFlightDatagram in_flight;
    std::uint64_t to_pass;
    Instant give_up;
  };
  struct LateRequest {
    std::vector<std::uint8_t> bytes;
    Peer peer;
  };
  /// What the script does to one datagram.
  struct FaultDecision {
    bool dropped = false;
    bool replaced = false;
    Instant due{0};
    std::uint64_t depth = 0;
    Duration overtaken_for{0};
    std::vector<Duration> copies;
    std::vector<std::uint64_t> sizes;
    std::uint64_t foreign = 0;
  };
  void meet_events(Instant now);
  void schedule() noexcept;
  void begin(std::size_t index);
  void end(const Fault& fault);
  void sample_disturbed(LoadCellSample sample);
  void sample_skewed(const LoadCellSample& sample);
  void move_to(const std::string& address);
  void count_use(std::size_t fault, Instant now);
  void hand_over(std::span<const std::uint8_t> datagram, Peer peer);
  StreamReply spoilt(std::string answer, Instant now, FaultKind first, FaultKind last);

  void carry_all(Instant now);
  void carry(const InFlightDatagram& in_flight);
  void make_up(const InFlightDatagram& after, std::size_t size, bool foreign, Instant due);
  [[nodiscard]] FaultDecision decide(Instant at);
  /// False: it spared this datagram.
  bool act(const Fault& fault, Progress& progress, Instant at, FaultDecision& decision);
  void let_pass(Instant due);
  void give_up_holding(Instant now);
  void shorten(Datagram& datagram);
  std::size_t enter(const Datagram& datagram);
  void count_arrival(const InFlightDatagram& in_flight, Instant at);

  NetBoxDevice& box_;
  ScriptRun script_;
  const Keep keep_;
  std::vector<Progress> progress_;
  std::multimap<Instant, LateRequest> late_requests_;  ///< by their arrival
  Instant next_event_ = kNever;
  bool disturbed_ = false;  ///< dead, skewed or drifting
  bool dead_ = false;
  std::vector<std::size_t> drifting_;
  std::string moved_to_, first_address_;
  const Fault* skew_ = nullptr;                         ///< nullptr: its clock is right
  double phase_ = 0;                                    ///< of the box's clock, in its samples
  std::multimap<Instant, InFlightDatagram> under_way_;  ///< by their arrival
  std::vector<Held> held_;
  Instant last_due_{0};
  WireTruth truth_;
};

}  // namespace kphi::sim
