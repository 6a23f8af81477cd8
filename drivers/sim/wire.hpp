// The wire between the simulated box and its clients, with the faults of a script: virtual time, seeded, no I/O. With
// the same seed, script and inputs the same bytes arrive at the same times, however often it is asked.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/sim/faults.hpp"
#include "drivers/sim/netbox_device.hpp"
#include "drivers/sim/random.hpp"
#include "drivers/sim/under_way.hpp"
#include "drivers/sim/wire_truth.hpp"

namespace kphi::sim {

/// The client that steals streams; what the box sends to it leaves the wire unseen.
inline constexpr Peer kThief = ~Peer{0};

/// What the box says over a stream socket. Bench times.
struct StreamReply {
  std::string bytes;
  Duration wait{0};         ///< before the first byte
  std::size_t segment = 0;  ///< at most so many bytes at once; 0: all
  Duration pause{0};        ///< between two segments
  bool close = false;       ///< after the last byte
};

class FaultyWire {
 public:
  /// How much truth is kept beside the totals.
  enum class Keep : std::uint8_t { totals, datagrams, samples };
  /// `box` outlives the wire. Faults act in the order of the script.
  FaultyWire(NetBoxDevice& box, FaultScript script, std::uint64_t seed, Keep keep = Keep::totals);
  FaultyWire(const FaultyWire&) = delete;
  FaultyWire& operator=(const FaultyWire&) = delete;

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
  /// Earliest arrival of what is under way; kNever when nothing is.
  [[nodiscard]] Instant next_arrival() const noexcept;

  /// Answer to one complete request.
  [[nodiscard]] StreamReply http(std::string_view request, Instant now);
  /// Nobody listens on the web server's port now.
  [[nodiscard]] bool http_refused(Instant now) const noexcept;
  /// As NetBoxDevice::tcp; an empty reply when `received` holds no whole command.
  [[nodiscard]] StreamReply tcp(std::string& received, Instant now);
  [[nodiscard]] bool dead() const noexcept { return dead_; }
  /// Where the box is since a fault gave it another address: what it sends comes from there. Empty: where it was.
  [[nodiscard]] const std::string& moved_to() const noexcept { return moved_to_; }
  [[nodiscard]] const WireTruth& truth() const noexcept { return truth_; }

 private:
  struct Progress {
    std::uint64_t used = 0;        ///< of Fault::count
    std::uint64_t burst_left = 0;  ///< of a loss
    bool bad = false;              ///< Gilbert-Elliott
  };
  struct Event {
    Instant at;
    std::size_t fault;
    bool begins;
  };
  struct Parcel {
    Datagram datagram;
    std::size_t entry = 0;  ///< in the log
    bool whole = true;      ///< records of the box, not made up
    bool copy = false;
  };
  struct Held {
    Parcel parcel;
    std::uint64_t to_pass;
    Instant give_up;
  };
  struct LateRequest {
    Instant due;
    std::vector<std::uint8_t> bytes;
    Peer peer;
  };
  /// What the script does to one datagram.
  struct Fate {
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
  void begin(const Fault& fault, Instant now);
  void end(const Fault& fault);
  void note(Instant at, std::string what);
  void sample_disturbed(LoadCellSample sample);
  void sample_skewed(const LoadCellSample& sample);
  void move_to(const std::string& address);
  void count_use(std::size_t fault, Instant now, std::uint64_t WireTruth::*counter);
  void hand_over(std::span<const std::uint8_t> datagram, Peer peer);

  void carry_all(Instant now);
  void carry(const Parcel& parcel);
  void make_up(const Parcel& after, std::size_t size, bool foreign, Instant due);
  [[nodiscard]] Fate decide(Instant at);
  void act(const Fault& fault, Progress& progress, Instant at, Fate& fate);
  void let_pass(Instant due);
  void give_up_holding(Instant now);
  void shorten(Datagram& datagram);
  std::size_t enter(const Datagram& datagram);
  void count_arrival(const Parcel& parcel, Instant at);
  [[nodiscard]] bool active(std::size_t fault, Instant at) const noexcept;
  [[nodiscard]] bool chance(double p) noexcept { return 0.5 * (random_.symmetric() + 1) < p; }

  NetBoxDevice& box_;
  const FaultScript script_;
  Random random_;
  const Keep keep_;
  bool direct_ = true;  ///< no fault concerns datagrams on their way
  std::vector<Progress> progress_;
  std::vector<Event> events_;  ///< latest first
  std::vector<LateRequest> late_requests_;
  Instant next_event_ = kNever;
  bool disturbed_ = false;  ///< dead, skewed or drifting
  bool dead_ = false;
  bool skewed_ = false;
  std::vector<std::size_t> drifting_;
  std::string moved_to_, first_address_;
  const Fault* skew_ = nullptr;
  double phase_ = 0;  ///< of the box's clock, in its samples
  UnderWay<Parcel> under_way_;
  std::vector<Held> held_;
  Instant last_due_{0};
  Parcel passing_;
  WireTruth truth_;
};

}  // namespace kphi::sim
