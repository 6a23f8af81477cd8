// Each fault alone: what the driver delivers was sent so, what it counts happened, it recovers, and it never spins
// after a coast.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/drivers/iq_faults/joined.hpp"

namespace kphi::iq::test {
namespace each_fault_test {

using namespace std::chrono_literals;
using sim::FaultEntry;

constexpr Duration kReplyTimeout = 100ms;
constexpr Instant kEnd = 5s;  // faults come at 3 s: old firmware takes more than two to be known

// Behaviour and song of the timeout, three times each, and the newer coil estimator, twice.
constexpr std::uint64_t kUnknownToOldFirmware = 8;

struct Mode {
  const char* name;
  Manner manner;
};

void PrintTo(const Mode& mode, std::ostream* out) { *out << mode.name; }

class EachMotorFault : public testing::TestWithParam<Mode> {
 protected:
  Joined& join(sim::FaultScript faults, Instant end) {
    joined.emplace(manner, std::move(faults), 42);
    joined->run_until(end);
    return *joined;
  }
  Joined& run(sim::FaultScript faults, Instant end = kEnd) {
    join(std::move(faults), end).finish();
    EXPECT_EQ(joined->disagreement(), "");
    EXPECT_EQ(joined->danger(), "");
    EXPECT_GT(joined->ready_at(), Instant{0});
    EXPECT_GT(joined->readings().size(), 50u);
    return *joined;
  }
  /// A fault of replies, with probability 0.1 from 3 to 4 s.
  Joined& run_one(FaultEntry entry) {
    entry.insert({{"at_s", "3"}, {"for_s", "1"}, {"p", "0.1"}});
    Joined& j = run(script({entry}));
    EXPECT_EQ(j.failures(), 0) << j.first_failure();
    EXPECT_LE(j.silence_after(4s), recovery()) << "recovers";
    return j;
  }
  [[nodiscard]] std::uint64_t done(sim::FaultKind kind) const { return joined->truth().done.at(kind); }
  /// Requests that timed out, but for those that old firmware has no answer to.
  [[nodiscard]] static std::uint64_t lost(const Joined& j) {
    const bool old = j.session().identity().coil_temperature_client() == 77;
    return j.counters().timeouts - (old ? kUnknownToOldFirmware : 0);
  }
  /// One request timeout and until the next poll is answered.
  [[nodiscard]] Duration recovery() const {
    return kReplyTimeout + 2 * from_seconds(1 / GetParam().manner.telemetry_hz) + 20ms;
  }
  Manner manner = GetParam().manner;
  std::optional<Joined> joined;
};

TEST_P(EachMotorFault, NoneAtAll) {
  Joined& j = run({});
  EXPECT_EQ(j.failures(), 0);
  EXPECT_EQ(lost(j), 0u);
  EXPECT_EQ(j.counters().crc_errors, 0u);
  EXPECT_EQ(j.counters().resyncs, 0u);
  EXPECT_TRUE(std::any_of(j.readings().begin(), j.readings().end(),
                          [](const MotorReading& r) { return r.channel == MotorChannel::speed && r.value > 850; }));
  EXPECT_TRUE(j.session().coasting());
}

TEST_P(EachMotorFault, FlippedBits) {
  EXPECT_GT(run_one({{"kind", "motor_flip"}, {"bits", "3"}}).counters().timeouts, 0u);
}

TEST_P(EachMotorFault, BadChecksums) {
  const Counters& c = run_one({{"kind", "motor_bad_crc"}}).counters();
  EXPECT_GE(c.crc_errors, done(sim::FaultKind::motor_bad_crc));
  EXPECT_EQ(lost(*joined), done(sim::FaultKind::motor_bad_crc));
}

TEST_P(EachMotorFault, DroppedReplies) {
  run_one({{"kind", "motor_drop"}});
  EXPECT_EQ(lost(*joined), done(sim::FaultKind::motor_drop));
}

TEST_P(EachMotorFault, DuplicatedReplies) {
  const Counters& c = run_one({{"kind", "motor_duplicate"}}).counters();
  EXPECT_EQ(c.unasked, done(sim::FaultKind::motor_duplicate));
  EXPECT_EQ(lost(*joined), 0u);
}

TEST_P(EachMotorFault, NothingIsLostBetweenGarbageAndOutOfStep) {
  std::vector<FaultEntry> entries{{{"kind", "motor_reorder"}},
                                  {{"kind", "motor_garbage"}, {"size", "20"}},
                                  {{"kind", "motor_merge"}, {"delay_s", "0.03"}, {"p", "1"}},
                                  {{"kind", "motor_split"}, {"delay_s", "0.0005"}},
                                  {{"kind", "motor_delay"}, {"delay_s", "0.03"}, {"p", "0.02"}}};
  for (const char* bytes : {"55", "55 55 55", "55 3B", "55 3B 32", "55 1E 32", "55 FF", "55 0A 32", "00 FF 12"})
    entries.push_back({{"kind", "motor_garbage"}, {"bytes", bytes}});
  for (const FaultEntry& entry : entries) {
    SCOPED_TRACE(testing::PrintToString(entry));
    EXPECT_EQ(lost(run_one(entry)), 0u);
  }
}

TEST_P(EachMotorFault, TruncatedReplies) {
  for (const char* size : {"0", "1", "2", "6", "9"}) {
    EXPECT_GT(run_one({{"kind", "motor_truncate"}, {"size", size}}).counters().timeouts, 0u) << size;
  }
}

TEST_P(EachMotorFault, StallsWithinAReply) {
  run_one({{"kind", "motor_stall"}, {"size", "4"}, {"delay_s", "0.05"}});
  run_one({{"kind", "motor_stall"}, {"size", "4"}, {"delay_s", "0.15"}, {"count", "1"}});
  EXPECT_GT(joined->counters().resyncs, 0u);
}

TEST_P(EachMotorFault, ALineThatFallsFarBehindIsNoStaleAnswer) {
  join(
      script(
          {{{"kind", "motor_stall"}, {"size", "4"}, {"delay_s", "0.15"}, {"at_s", "3"}, {"for_s", "1"}, {"p", "0.1"}}}),
      kEnd)
      .finish();
  EXPECT_EQ(joined->danger(), "");
  EXPECT_EQ(joined->disagreement(), "");
  EXPECT_GT(joined->counters().late_replies, 0u);
}

TEST_P(EachMotorFault, LatencyAboveTheTimeoutIsNoStaleAnswer) {
  run(script({{{"kind", "motor_delay"}, {"at_s", "3"}, {"count", "1"}, {"delay_s", "0.15"}}}));
  EXPECT_GT(joined->counters().late_replies, 0u);
  EXPECT_EQ(joined->failures(), 0);
}

TEST_P(EachMotorFault, ImpossibleNumbers) {
  for (const char* value : {"nan", "inf", "-inf"}) {
    Joined& j = run_one({{"kind", "motor_value"}, {"value", value}, {"type", "50"}, {"sub", "13"}});
    EXPECT_EQ(j.counters().bad_values, done(sim::FaultKind::motor_value));
    EXPECT_TRUE(std::all_of(j.readings().begin(), j.readings().end(),
                            [](const MotorReading& r) { return std::isfinite(r.value); }));
  }
  run_one({{"kind", "motor_value"}, {"value", "denormal"}, {"type", "50"}, {"sub", "13"}});
}

TEST_P(EachMotorFault, WrongLengths) {
  for (const char* size : {"0", "2", "5", "16"}) {
    const Counters& c =
        run_one({{"kind", "motor_wrong_length"}, {"size", size}, {"type", "50"}, {"sub", "13"}}).counters();
    EXPECT_EQ(c.wrong_length, done(sim::FaultKind::motor_wrong_length)) << size;
  }
}

TEST_P(EachMotorFault, WrongIds) {
  for (const char* id : {"7", "63"}) {
    const Counters& c = run_one({{"kind", "motor_wrong_id"}, {"id", id}}).counters();
    EXPECT_EQ(c.wrong_module, done(sim::FaultKind::motor_wrong_id)) << id;
  }
}

TEST_P(EachMotorFault, StuckValuesAreDeliveredAsSent) { run_one({{"kind", "motor_stuck"}, {"p", "1"}}); }

TEST_P(EachMotorFault, ABreakShorterThanPatience) {
  for (const char* kind : {"motor_mute", "motor_deaf"}) {
    SCOPED_TRACE(kind);
    run(script({{{"kind", kind}, {"at_s", "3"}, {"for_s", "0.3"}}}));
    EXPECT_EQ(joined->failures(), 0) << joined->first_failure();
    EXPECT_GT(joined->counters().timeouts, 0u);
  }
}

TEST_P(EachMotorFault, ABreakLongerThanPatienceEndsTheMotion) {
  for (const char* kind : {"motor_mute", "motor_deaf"}) {
    SCOPED_TRACE(kind);
    run(script({{{"kind", kind}, {"at_s", "3"}, {"for_s", "2.5"}}}), 8s);
    EXPECT_GT(joined->failures(), 0);
    EXPECT_NE(joined->first_failure(), "");
    if (joined->module().singing()) continue;  // old firmware, until it is armed or spun: it never reports coast
    EXPECT_EQ(joined->session().state(), Session::State::ready) << "connected again: " << joined->session().failure();
  }
}

TEST_P(EachMotorFault, FlippedCommandsLoseNoSafety) {
  run(script({{{"kind", "motor_command_flip"}, {"at_s", "3"}, {"for_s", "4"}, {"p", "0.01"}}}), 6500ms);
  EXPECT_GT(joined->counters().timeouts, 0u);
}

TEST_P(EachMotorFault, CommandsFlippedWhileItConnects) {
  run(script({{{"kind", "motor_command_flip"}, {"at_s", "0"}, {"for_s", "2"}, {"p", "0.01"}}}), 6s);
}

TEST_P(EachMotorFault, UnpluggedAndPluggedInAgain) {
  run(script({{{"kind", "motor_unplug"}, {"at_s", "3"}, {"for_s", "1"}}}), 6s);
  EXPECT_TRUE(joined->saw(EventKind::motor_port_lost));
  if (joined->module().singing()) return;  // as above
  EXPECT_EQ(joined->session().state(), Session::State::ready) << joined->session().failure();
  EXPECT_FALSE(joined->session().armed()) << "until the owner rearms it";
}

TEST_P(EachMotorFault, AnotherModulePluggedInIsToldNothingButCoast) {
  run(script({{{"kind", "motor_unplug"}, {"at_s", "3"}, {"for_s", "1"}, {"other", "true"}}}), 6s);
  EXPECT_TRUE(joined->saw(EventKind::motor_another_module));
  EXPECT_NE(joined->session().state(), Session::State::ready);
  EXPECT_GT(joined->silence_after(3100ms), 1h) << "nothing of it is delivered";
  EXPECT_LT(joined->module().last_motion().target, 1) << "it never spun";
}

TEST_P(EachMotorFault, ABrownOutIsSeenAndDisarms) {
  for (const char* down : {"0", "0.2", "0.8"}) {
    SCOPED_TRACE(down);
    run(script({{{"kind", "motor_brown_out"}, {"at_s", "3"}, {"down_s", down}}}), 7s);
    EXPECT_GT(joined->failures(), 0);
    EXPECT_TRUE(joined->saw(EventKind::motor_reset) || joined->saw(EventKind::motor_silent));
    EXPECT_EQ(joined->session().state(), Session::State::ready) << joined->session().failure();
    EXPECT_FALSE(joined->session().armed());
  }
}

TEST_P(EachMotorFault, SetsAreIgnored) {
  run(script({{{"kind", "motor_ignore_sets"}, {"at_s", "3"}, {"for_s", "2"}}}), 5s);
}

TEST_P(EachMotorFault, SetsAreIgnoredWhileItConnects) {
  manner.module_timeout_s = 0.4;  // the module's own is 0.5
  const Joined& j = join(script({{{"kind", "motor_ignore_sets"}, {"at_s", "0"}, {"for_s", "1"}}}), 900ms);
  EXPECT_NE(j.session().state(), Session::State::ready) << "a module that takes no timeout may not spin";
  EXPECT_EQ(j.motor().speed, 0);
}

TEST_P(EachMotorFault, CoastIsRepeatedUntilTheModuleHearsAgain) {
  join(script({{{"kind", "motor_deaf"}, {"at_s", "3"}, {"for_s", "0.25"}}}), 3100ms);
  EXPECT_EQ(joined->module().drive().mode, sim::MotorDrive::Mode::velocity);
  joined->finish();
  EXPECT_EQ(joined->danger(), "");
  EXPECT_LT(joined->module().last_motion().at, 3600ms);
  EXPECT_TRUE(joined->session().coasting());
}

TEST_P(EachMotorFault, ADeadLineLeavesTheModuleToItsOwnTimeout) {
  join(script({{{"kind", "motor_deaf"}, {"at_s", "3"}, {"for_s", "100"}}}), 3700ms);
  EXPECT_EQ(joined->module().drive().mode, sim::MotorDrive::Mode::coast);
  EXPECT_EQ(joined->module().timeouts(), 1u);
}

TEST_P(EachMotorFault, ADumbModuleThatIgnoresTheCoastIsLeftToItsTimeout) {
  join(script({{{"kind", "motor_ignore_sets"}, {"at_s", "3"}, {"for_s", "100"}}}), 3500ms).finish();
  EXPECT_EQ(joined->danger(), "") << "polling must not keep it alive";
  EXPECT_EQ(joined->module().timeouts(), 1u);
}

TEST_P(EachMotorFault, ASpeedTakenBackNeverReachesThePort) {
  manner.port_takes = 2;  // frames wait in the driver
  join({}, 4s).finish();
  const Instant before = joined->module().last_motion().at;
  for (int i = 0; i < 50; ++i) {
    joined->waver();
    joined->run_until(8s + i * 20ms);
  }
  EXPECT_EQ(joined->danger(), "");
  EXPECT_GT(joined->module().last_motion().at, before) << "the coasts arrive";
  EXPECT_LT(joined->motor().speed, 1);
}

TEST_P(EachMotorFault, PhysicsMayGoWrongWithoutTheAccount) {
  for (const FaultEntry& entry : std::vector<FaultEntry>{{{"kind", "motor_hot"}, {"coil_celsius", "150"}},
                                                         {{"kind", "motor_hot"}, {"controller_celsius", "75"}},
                                                         {{"kind", "motor_redline"}, {"speed_rad_s", "300"}},
                                                         {{"kind", "motor_over_voltage"}, {"volts", "20"}},
                                                         {{"kind", "motor_sag"}, {"volts", "5"}},
                                                         {{"kind", "motor_sag"}, {"volts", "11"}},
                                                         {{"kind", "motor_locked"}}}) {
    FaultEntry whole = entry;
    whole.insert({{"at_s", "3"}, {"for_s", "1"}});
    SCOPED_TRACE(whole.at("kind"));
    run(script({whole}), 4s);
  }
}

TEST_P(EachMotorFault, DeratesAreDelivered) {
  run(script({{{"kind", "motor_redline"}, {"speed_rad_s", "300"}, {"at_s", "3"}, {"for_s", "1"}}}), 3s);
  EXPECT_TRUE(std::any_of(joined->readings().begin(), joined->readings().end(),
                          [](const MotorReading& r) { return r.channel == MotorChannel::derate && r.value < 1; }));
}

const Mode kModes[] = {
    {"At115200", {}},
    {"At921600And400Hz", {.telemetry_hz = 400, .baud = 921600}},
    {"BehindA16msAdapter", {.usb_tick = 16ms}},
    {"LegacyFirmware", {.quirks = sim::kLegacyFirmware}},
    {"WithoutWireTimeAsModule42", {.paced = false, .module_id = 42, .reply_latency = 0s, .reply_jitter = 0s}},
};

INSTANTIATE_TEST_SUITE_P(, EachMotorFault, testing::ValuesIn(kModes),
                         [](const auto& mode) { return std::string(mode.param.name); });

}  // namespace each_fault_test
}  // namespace kphi::iq::test
