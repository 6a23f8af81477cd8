// A meter or power analyser that speaks SCPI, over USB or TCP.
#pragma once

#include "drivers/scpi/line.hpp"
#include "drivers/scpi/meter.hpp"

namespace kphi::scpi {

/// What to ask it for: a hand multimeter measures one quantity at a time, an analyser all three at once.
struct Quantities {
  bool voltage = true, current = true, power = false;
};

class ScpiMeter final : public Meter {
 public:
  /// Asks who it is (*IDN?) and for each quantity once, so that what it cannot measure is known now. `line` and `clock`
  /// must outlive this. Throws DeviceError; std::invalid_argument when no quantity is wanted.
  ScpiMeter(Line& line, const Clock& clock, const Quantities& quantities = {});

  [[nodiscard]] MeterReading read() override;
  [[nodiscard]] const std::string& identity() const noexcept override { return identity_; }

 private:
  [[nodiscard]] double measure(const char* query);

  Line& line_;
  const Clock& clock_;
  const Quantities quantities_;
  std::string identity_;
};

}  // namespace kphi::scpi
