// Two hundred random mixtures of faults, each from its seed: nothing wrong is ever delivered, every loss is counted,
// and the motor coasts at the end.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "test/dice.hpp"
#include "test/drivers/iq_faults/joined.hpp"

namespace kphi::iq::test {
namespace mixtures_test {

using namespace std::chrono_literals;
using kphi::test::Dice;
using sim::Fault;
using K = sim::FaultKind;

Manner random_manner(Dice& dice) {
  Manner manner;
  manner.paced = dice.whole(0, 3) > 0;
  manner.baud = std::array{115200u, 115200u, 921600u}[static_cast<std::size_t>(dice.whole(0, 2))];
  manner.telemetry_hz = std::array{20.0, 50.0, 200.0}[static_cast<std::size_t>(dice.whole(0, 2))];
  manner.module_id = dice.whole(0, 1) * 17;
  manner.usb_tick = std::array<Duration, 3>{0ms, 1ms, 16ms}[static_cast<std::size_t>(dice.whole(0, 2))];
  if (dice.whole(0, 4) == 0) manner.quirks = sim::kLegacyFirmware;
  manner.quirks.system_control_on_id_zero = false;
  return manner;
}

/// Of replies and bytes: between 0.1 and 3.5 s.
Fault random_fault(Dice& dice) {
  Fault fault;
  fault.at = from_seconds(dice.real(0.1, 2.5));
  fault.lasts = from_seconds(dice.real(0.05, 1));
  fault.p = dice.real(0.005, 0.3);
  fault.kind = static_cast<K>(dice.whole(static_cast<int>(K::motor_flip), static_cast<int>(K::motor_command_flip)));
  fault.bits = static_cast<std::uint64_t>(dice.whole(1, 3));
  fault.size = static_cast<std::uint64_t>(dice.whole(0, 9));
  fault.id = static_cast<std::uint64_t>(dice.whole(18, 63));
  fault.delay = from_seconds(dice.real(0.0001, 0.02));
  fault.jitter = from_seconds(dice.real(0, 0.01));
  if (fault.kind == K::motor_garbage && dice.whole(0, 1) == 0)
    fault.bytes = std::array<std::vector<std::uint8_t>, 3>{
        {{0x55}, {0x55, 0x3b}, {0x55, 0xff}}}[static_cast<std::size_t>(dice.whole(0, 2))];
  if (fault.kind == K::motor_value)
    fault.reading = std::array{std::nan(""), 1e-42, HUGE_VAL}[static_cast<std::size_t>(dice.whole(0, 2))];
  if (fault.kind == K::motor_wrong_length && fault.size == 4) fault.size = 3;
  if (fault.kind == K::motor_delay && dice.whole(0, 1) == 0) {
    fault.delay = from_seconds(dice.real(0.05, 0.3));
    fault.count = 1;
  }
  if (fault.kind == K::motor_split) fault.delay /= 20;
  if (fault.kind == K::motor_command_flip) fault.p *= 0.05;
  if (fault.kind == K::motor_mute || fault.kind == K::motor_deaf) fault.lasts = from_seconds(dice.real(0.01, 0.4));
  return fault;
}

/// At most one of the great ones, at any time.
void add_upheaval(Dice& dice, sim::FaultScript& script) {
  constexpr std::array kGreat{K::motor_unplug,  K::motor_brown_out, K::motor_ignore_sets,
                              K::motor_redline, K::motor_hot,       K::motor_sag,
                              K::motor_locked,  K::motor_mute,      K::motor_over_voltage};
  if (dice.whole(0, 2) > 0) return;
  Fault fault;
  fault.kind = kGreat[static_cast<std::size_t>(dice.whole(0, kGreat.size() - 1))];
  fault.at = from_seconds(dice.real(0.5, 3));
  fault.lasts = from_seconds(dice.real(0.3, 1.5));
  fault.down = from_seconds(dice.real(0, 0.5));
  fault.other = dice.whole(0, 1) == 1;
  fault.speed = 200;
  fault.coil = dice.real(50, 150);
  fault.volts = dice.real(1, 20);
  if (fault.kind == K::motor_brown_out) fault.lasts = Duration{0};
  script.push_back(fault);
}

/// One request timeout, a slow adapter, and until the next poll is answered.
Duration recovery(const Manner& manner) { return 120ms + manner.usb_tick + 2 * from_seconds(1 / manner.telemetry_hz); }

class MotorMixtures : public testing::TestWithParam<int> {};

TEST_P(MotorMixtures, NothingWrongIsDeliveredAndNothingSpinsOn) {
  for (int i = 0; i < 10; ++i) {
    const auto seed = static_cast<std::uint64_t>(GetParam() * 10 + i);
    Dice dice(seed);
    const Manner manner = random_manner(dice);
    sim::FaultScript faults;
    for (int n = dice.whole(1, 5); n > 0; --n) faults.push_back(random_fault(dice));
    add_upheaval(dice, faults);
    std::string description;
    Instant over{0};
    for (const Fault& fault : faults) {
      description += std::string(name_of(fault.kind)) + " at " + std::to_string(to_seconds(fault.at)) + " for " +
                     std::to_string(to_seconds(fault.lasts)) + ", p " + std::to_string(fault.p) + "\n";
      over = std::max(over, fault.at + fault.lasts + fault.down);
    }
    Joined joined(manner, faults, seed);
    joined.run_until(over + 4s);
    joined.finish();
    SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(manner.baud) + " baud, " +
                 std::to_string(manner.telemetry_hz) + " Hz\n" + description + joined.first_failure());
    EXPECT_EQ(joined.disagreement(), "");
    EXPECT_EQ(joined.danger(), "");
    const bool exchanged =
        std::any_of(faults.begin(), faults.end(), [](const Fault& f) { return f.kind == K::motor_unplug && f.other; });
    if (exchanged) {
      EXPECT_TRUE(joined.saw(EventKind::motor_another_module));
      EXPECT_GT(joined.silence_after(over), 1h) << "nothing of another module is delivered";
      continue;
    }
    if (joined.module().singing()) {  // old firmware after its time-out, until its supply is switched off and on
      EXPECT_NE(joined.session().state(), Session::State::ready) << "it does not confirm its coast";
      continue;
    }
    const bool went_on = joined.failures() == 0 && joined.ready_at() < over;
    EXPECT_LT(joined.silence_after(over), went_on ? recovery(manner) : 3s) << "it recovers";
    EXPECT_EQ(joined.session().state(), Session::State::ready) << joined.session().failure();
  }
}

INSTANTIATE_TEST_SUITE_P(TenSeedsEach, MotorMixtures, testing::Range(0, 20));

}  // namespace mixtures_test
}  // namespace kphi::iq::test
