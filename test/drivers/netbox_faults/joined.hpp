// The driver's session joined with the simulator's wire, one thread, virtual time: and what a perfect driver would say.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/netbox/stream/session.hpp"
#include "drivers/sim/netbox/fault_injector.hpp"
#include "test/drivers/netbox_faults/ideal.hpp"

namespace kphi::netbox::test {

struct Manner {
  int records_per_datagram = 40;
  int divisor = 1;
  std::uint32_t first_ft = 0;
  bool start_again_when_silent = true;
  sim::NetBoxQuirks quirks;
};

class Joined {
 public:
  Joined(const Manner& manner, sim::FaultScript script, std::uint64_t seed);
  /// Starts the session at 0; from then on 7000 ticks a second.
  void run_until(Instant end);
  /// The host stands still, or is dead: nobody reads, nobody asks.
  void run_box_alone_until(Instant end);
  /// Delivers what waits, so that the account is complete.
  void finish();
  /// Both, and expects that driver and truth agree.
  void agree_until(Instant end);
  [[nodiscard]] Ideal ideal() const;
  /// Everything that differs between driver and truth; empty when they agree.
  [[nodiscard]] std::string disagreement() const;

  [[nodiscard]] Session& session() noexcept { return session_; }
  [[nodiscard]] const Counters& counters() const noexcept { return session_.counters(); }
  [[nodiscard]] sim::FaultInjector& wire() noexcept { return wire_; }
  [[nodiscard]] sim::NetBoxDevice& box() noexcept { return box_; }
  [[nodiscard]] const std::vector<LoadCellRecord>& out() const noexcept { return out_; }
  [[nodiscard]] int silences() const noexcept { return silences_; }

 private:
  Instant sample();
  void pump(Instant now);

  Manner manner_;
  sim::NetBoxDevice box_;
  sim::FaultInjector wire_;
  Session session_;
  std::vector<LoadCellRecord> out_;
  std::vector<Arrival> arrivals_;  // of whole datagrams that the session did not drain
  std::uint64_t drained_ = 0;
  int silences_ = 0;
  std::uint64_t tick_ = 0;
};

}  // namespace kphi::netbox::test
