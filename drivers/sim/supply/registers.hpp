// The registers of simulated supplies: Riden RD60xx, RuiDeng DPS/DPH, Hanmatek HM3xx. Those that no driver evaluates,
// such as power, charge and energy, read 0.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim/supply/circuit.hpp"

namespace kphi::sim {

struct SupplyModel {
  enum class Family : std::uint8_t { riden, dps, hanmatek };
  std::string_view name;
  Family family;
  std::uint16_t id;
  double counts_per_v, counts_per_a, counts_per_a_wide;  ///< wide: RD6012P with register 20 at 1; 0: no such range
  double volts_max;
  unsigned most_registers;  ///< in one request
};

[[nodiscard]] const std::vector<SupplyModel>& supply_models();

/// The content of a register.
enum class SupplyQuantity : std::uint8_t {
  kept,      ///< what was written last; 0 before
  constant,  ///< of the row
  model_id,
  serial_high,
  serial_low,
  set_volts,
  set_amps,
  volts,
  amps,
  trip,
  limiting,
  output,
  preset,  ///< reads 0, whatever was recalled
  over_volts,
  over_amps
};

class SupplyRegisters {
 public:
  /// Throws std::invalid_argument for a model that is not in the table. `over_current_in_milliamps`: on a Hanmatek,
  /// where sources disagree.
  SupplyRegisters(const std::string& model, std::uint32_t serial, bool over_current_in_milliamps,
                  SupplyCircuit& circuit);

  /// nullopt: no such register.
  [[nodiscard]] std::optional<std::uint16_t> read(std::uint16_t at) const;
  /// False: no such register, or read-only.
  bool write(std::uint16_t at, std::uint16_t value);
  [[nodiscard]] const SupplyModel& model() const noexcept { return *model_; }
  /// Writes to calibration and bootloader so far: what a driver must never do.
  [[nodiscard]] std::uint64_t harmful_writes() const noexcept { return harmful_writes_; }

 private:
  [[nodiscard]] std::uint16_t value_of(SupplyQuantity shows, std::uint16_t at) const;
  void recall(std::uint16_t preset);
  [[nodiscard]] std::uint16_t remembered(std::uint16_t at) const;
  [[nodiscard]] double per_v() const noexcept { return model_->counts_per_v; }
  [[nodiscard]] double per_a() const noexcept;
  [[nodiscard]] double per_over_a() const noexcept;
  [[nodiscard]] std::uint16_t trip_code() const noexcept;

  const SupplyModel* model_;
  std::uint32_t serial_;
  bool over_current_in_milliamps_;
  SupplyCircuit& circuit_;
  std::map<std::uint16_t, std::uint16_t> memory_;  ///< what is only kept
  std::uint64_t harmful_writes_ = 0;
};

}  // namespace kphi::sim
