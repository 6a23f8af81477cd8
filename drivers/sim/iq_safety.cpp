#include "drivers/sim/iq_safety.hpp"

#include "drivers/iq/codes.hpp"

namespace kphi::sim {
namespace {

constexpr std::uint8_t kPowerSafety = 84;
constexpr double kReferenceVolts = 1.2;
constexpr double kDetectorVolts = 3.6;  // of the input, when the module's own 3.3 V fall to 2.8 V

constexpr std::uint8_t bit(iq::FaultBit fault) noexcept {
  return static_cast<std::uint8_t>(1u << static_cast<unsigned>(fault));
}

}  // namespace

bool IqSafety::check(const IqMemory& memory, const IqReadings& readings) noexcept {
  struct Watched {
    iq::FaultBit fault;
    double value;
    std::uint8_t low;  ///< row of the lower limit; the upper follows
  };
  const Watched watched[] = {
      {iq::FaultBit::input_voltage, readings.volts, 3},
      {iq::FaultBit::reference_voltage, kReferenceVolts, 5},
      {iq::FaultBit::supply_current, readings.amps, 7},
      {iq::FaultBit::motor_current, readings.motor_amps, 9},
      {iq::FaultBit::controller_temperature, readings.controller_celsius, 11},
      {iq::FaultBit::coil_temperature, readings.coil_celsius, 13},
  };
  now_ = readings.volts < kDetectorVolts ? bit(iq::FaultBit::under_voltage) : 0;
  for (const Watched& w : watched) {
    const double low = memory.value(kPowerSafety, w.low);
    const double high = memory.value(kPowerSafety, static_cast<std::uint8_t>(w.low + 1));
    if (w.value < low || w.value > high) now_ |= bit(w.fault);
  }
  ever_ |= now_;
  const bool latching = memory.value(kPowerSafety, 2) != 0;
  const bool was = safe_;
  safe_ = latching ? ever_ != 0 : now_ != 0;
  return safe_ && !was;
}

}  // namespace kphi::sim
