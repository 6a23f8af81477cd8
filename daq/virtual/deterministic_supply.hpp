// The simulated supply without a transport: read eight times per second of virtual time, with its driver's patience for
// a faulty wire.
#pragma once

#include <string>
#include <vector>

#include "base/clock.hpp"
#include "daq/bench/bench.hpp"
#include "drivers/sim/supply/slave.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::daq {

class DeterministicSupply final : public SupplyLink {
 public:
  /// Both outlive this.
  DeterministicSupply(const profiles::SupplyConfig& config, sim::SupplySlave& slave, const Clock& clock)
      : config_(config), slave_(slave), circuit_(slave.circuit()), clock_(clock) {}
  [[nodiscard]] std::string identity() const override { return "simulated supply"; }
  std::size_t take(std::span<SupplyReading> out) override;
  [[nodiscard]] std::string failure() const override { return failure_; }
  void cut() noexcept override { (void)switch_off(); }
  [[nodiscard]] std::string switch_off() noexcept override;
  /// The program is gone: the supply stays as it is.
  void abandon() noexcept { abandoned_ = true; }
  /// Call it whenever time has passed.
  void look();

 private:
  void switch_on(const StopAsked& stop_asked) override;
  [[nodiscard]] SupplyReading shown(Duration wait) const;
  void miss();

  const profiles::SupplyConfig config_;
  sim::SupplySlave& slave_;
  sim::SupplyCircuit& circuit_;
  const Clock& clock_;
  bool abandoned_ = false;
  Instant next_look_{0};
  int missed_ = 0;  ///< answers in a row
  std::string failure_;
  std::vector<SupplyReading> under_way_, readings_;
  Instant due_{0};  ///< of what is under way
};

}  // namespace kphi::daq
