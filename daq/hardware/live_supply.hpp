// The bench supply over Modbus or SCPI, in a thread of its own.
#pragma once

#include <memory>

#include "daq/bench/bench.hpp"
#include "drivers/supply/worker.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::daq {

class LiveSupply final : public SupplyLink {
 public:
  /// Finds it; its output is as it was. Throws DeviceError. `clock` outlives this.
  LiveSupply(const profiles::SupplyConfig& config, const Clock& clock);
  [[nodiscard]] std::string identity() const override;
  /// For the sentinel.
  [[nodiscard]] const std::optional<LastWord>& off() const { return worker_.identity().off; }
  std::size_t take(std::span<SupplyReading> out) override { return worker_.take(out); }
  [[nodiscard]] std::string failure() const override;
  [[nodiscard]] SupplyKeypad keypad() const override { return worker_.identity().keypad; }
  [[nodiscard]] Duration longest_reading() const noexcept override { return worker_.longest_look(); }
  void cut() noexcept override { worker_.switch_off(); }
  [[nodiscard]] std::string switch_off() noexcept override;

 private:
  void switch_on(const StopAsked& stop_asked) override;

  const profiles::SupplyConfig config_;
  const Clock& clock_;
  supply::Worker worker_;
};

/// Over Modbus or SCPI, as its URI says. Throws ConfigurationError, DeviceError.
[[nodiscard]] std::unique_ptr<supply::Supply> open_supply(const profiles::SupplyConfig& config, const Clock& clock);
/// "RD6018, serial 4711, firmware 1.28".
[[nodiscard]] std::string summary(const supply::Identity& identity);

}  // namespace kphi::daq
