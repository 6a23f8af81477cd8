// The simulated supply's circuit without a transport: looked at eight times per second of virtual time.
#pragma once

#include <vector>

#include "daq/supply_link.hpp"
#include "drivers/clock.hpp"
#include "drivers/sim/supply_circuit.hpp"
#include "profiles/supply_place.hpp"

namespace kphi::daq {

class DeterministicSupply final : public SupplyLink {
 public:
  /// Both outlive this.
  DeterministicSupply(const profiles::SupplyPlace& place, sim::SupplyCircuit& circuit, const Clock& clock)
      : place_(place), circuit_(circuit), clock_(clock) {}
  [[nodiscard]] std::string identity() const override { return "simulated supply"; }
  std::size_t take(std::span<results::SupplyReading> out) override;
  [[nodiscard]] std::string failure() const override { return ""; }
  void cut() noexcept override { (void)switch_off(); }
  [[nodiscard]] std::string switch_off() noexcept override;
  /// The program is gone: the supply goes on as it is.
  void abandon() noexcept { abandoned_ = true; }
  /// To be called when time has passed.
  void look();

 private:
  void switch_on() override;

  const profiles::SupplyPlace place_;
  sim::SupplyCircuit& circuit_;
  const Clock& clock_;
  bool abandoned_ = false;
  Instant next_look_{0};
  std::vector<results::SupplyReading> readings_;
};

}  // namespace kphi::daq
