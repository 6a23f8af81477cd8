// The serial line between the host and the simulated module, with the faults of a script: rate, adapter, breaks.
// Virtual time, seeded, no I/O. With the same seed, script and inputs the same bytes arrive at the same times.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "base/clock.hpp"
#include "drivers/sim/iq/device.hpp"
#include "drivers/sim/physics/motor.hpp"
#include "drivers/sim/script/faults.hpp"
#include "drivers/sim/script/script_run.hpp"

namespace kphi::sim {

struct IqLineSettings {
  bool paced = false;     ///< a byte takes 10 bits of its sender's rate, wall time; else none
  double time_scale = 1;  ///< bench seconds per wall second
  Duration usb_tick{
      0};  ///< the adapter hands over at multiples of this (wall time) what has come: 16 ms, 1 ms; 0: at once
};

/// One reply, as it was put on the wire.
struct SentIqReply : IqReply {
  Instant begun{0};            ///< when its first byte left
  Instant arrived{0};          ///< last byte of the first whole copy at the host
  std::set<FaultKind> done{};  ///< those that affected it
  std::uint32_t arrivals = 0;  ///< copies that arrived byte for byte with a good checksum
};

/// What truly happened on the motor's line: a driver's own counts are checked against it.
struct IqTruth {
  std::uint64_t bytes_from_host = 0, bytes_to_module = 0;  ///< given to the line; heard by the module
  std::uint64_t bytes_from_module = 0, bytes_to_host = 0;
  std::uint64_t replies = 0;                ///< that the module meant to send
  std::uint64_t frames_arrived = 0;         ///< whole, with a good checksum, at the host; copies included
  std::uint64_t spoilt = 0;                 ///< copies of replies that do not arrive whole
  std::map<FaultKind, std::uint64_t> done;  ///< replies, bytes or events, by kind of fault
  std::vector<FaultEvent> events;
  std::vector<SentIqReply> log;  ///< in the order of sending; only if asked for
};

/// Bytes that reached the host's port together.
struct IqChunk {
  Instant at{0};
  std::vector<std::uint8_t> bytes;
};

class IqLine {
 public:
  enum class Keep : std::uint8_t { totals, replies };
  /// `module` outlives the line. Faults act in the order of the script.
  IqLine(IqDevice& module, const IqLineSettings& settings, FaultScript script, std::uint64_t seed,
         Keep keep = Keep::totals);
  IqLine(const IqLine&) = delete;
  IqLine& operator=(const IqLine&) = delete;

  /// Bits per second of the host's port; 0: as the module.
  void host_rate(double baud) noexcept { host_rate_ = baud; }
  /// Bytes that the host gives to its port at `now`.
  void send(std::span<const std::uint8_t> bytes, Instant now);
  /// Delivers the bytes that are due and applies the script's events; `now` never goes back.
  void advance(Instant now);
  /// Next bytes that have arrived by `now`, the time of the last advance().
  bool next_chunk(IqChunk& out, Instant now);
  /// Time of the next arrival at either end or of the script's next event; kNever: none.
  [[nodiscard]] Instant next_event() const noexcept;

  /// The adapter is there.
  [[nodiscard]] bool plugged() const noexcept { return plugged_; }
  /// What the script does to motor and supply now.
  [[nodiscard]] const MotorUpset& upset() const noexcept { return upset_; }
  [[nodiscard]] const IqTruth& truth() const noexcept { return truth_; }

 private:
  /// A row of bytes on the way to the host.
  struct Passage {
    std::vector<std::uint8_t> bytes;
    std::size_t done = 0;  ///< bytes that have arrived
    Instant ready{0};      ///< not begun before
    Instant begun{-1};     ///< -1: not yet
    std::size_t stall_after = 0;
    Duration stall{0}, between{0};
    std::optional<Instant> together;  ///< all its bytes arrive then
    std::size_t entry = 0;            ///< in the log
    bool whole = false;               ///< a frame with a good checksum
    bool spoilt = false;              ///< by the line
  };
  /// What the script does to one reply.
  struct FaultDecision {
    SentIqReply reply;
    bool dropped = false, bad_crc = false;
    int copies = 1;
    std::uint64_t flips = 0;
    std::optional<std::size_t> truncated;
    std::vector<std::uint8_t> before;
    std::optional<Duration> overtaken_for;
    Passage passage;
  };
  struct Byte {
    Instant due;
    std::uint8_t byte;
  };

  void meet_events(Instant now);
  void begin(const Fault& fault, Instant now);
  void end(const Fault& fault, Instant now);
  void recompute(Instant now);
  void note(Instant at, const Fault& fault, const char* what);
  void carry_commands(Instant now);
  void take_replies(Instant now);
  void carry(const IqReply& reply);
  void act(std::size_t index, FaultDecision& decision);
  void emit(const FaultDecision& decision);
  void put(const FaultDecision& decision, std::size_t entry);
  void schedule(Passage passage);
  void release(Instant at);
  void arrive(Instant now);
  [[nodiscard]] Instant arrival_of(const Passage& passage) const noexcept;
  void finish(const Passage& passage, Instant at);
  void cut() noexcept;
  [[nodiscard]] bool concerns(const Fault& fault, const IqReply& reply) const noexcept;
  [[nodiscard]] Duration byte_time(double rate) const noexcept;
  [[nodiscard]] bool rates_match() const noexcept;
  [[nodiscard]] Instant handed_over(Instant at) const noexcept;
  [[nodiscard]] std::uint8_t random_byte() noexcept { return static_cast<std::uint8_t>(script_.bits() >> 40); }

  IqDevice& module_;
  const IqLineSettings settings_;
  ScriptRun script_;
  const Keep keep_;
  double host_rate_ = 0;
  std::vector<std::map<std::uint16_t, IqReply>> stuck_;  ///< by fault: the first reply of each entry
  bool plugged_ = true, mute_ = false, deaf_ = false;
  MotorUpset upset_;

  std::deque<Byte> to_module_;
  Instant host_free_{0};    ///< when the host's last byte will have left
  Instant module_free_{0};  ///< when the module's last byte will have left
  Instant last_arrival_{0};
  std::deque<Passage> to_host_;
  std::optional<FaultDecision> held_;
  Instant hold_until_{0};
  std::deque<IqChunk> chunks_;
  IqTruth truth_;
};

}  // namespace kphi::sim
