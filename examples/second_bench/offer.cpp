#include "examples/second_bench/offer.hpp"

#include "daq/bench/offered_drivers.hpp"
#include "examples/second_bench/esc_motor.hpp"
#include "examples/second_bench/serial_scale.hpp"

namespace kphi::second_bench {

void offer_drivers() {
  daq::offer_load_cell("hx711", [](const profiles::BenchConfig& bench, const Clock& clock) {
    return std::make_unique<SerialScale>(bench, clock);
  });
  daq::offer_motor("esc", [](const profiles::BenchConfig& bench, const Clock& clock) {
    return std::make_unique<EscMotor>(bench, clock);
  });
}

}  // namespace kphi::second_bench
