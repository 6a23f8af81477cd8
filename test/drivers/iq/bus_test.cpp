#include "drivers/iq/bus.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "test/drivers/iq/fake_module.hpp"

namespace kphi::iq {
namespace {

using namespace std::chrono_literals;
using fake::Bytes;
using State = Session::State;

/// Several modules that hear the same host and share the wire back, in virtual time.
class Line {
 public:
  explicit Line(const std::vector<int>& ids) : bus(settings_of(ids)), modules(ids.size()) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      modules[i].id = ids[i];
      modules[i].turns_at_once = false;
      modules[i].values[{5, 14}] = fake::u8(ids[i]);
      modules[i].values[{50, 13}] = fake::f32(100 + ids[i]);
    }
  }

  Bus bus;
  std::vector<fake::Module> modules;
  Instant now{0};
  int collisions = 0;  ///< replies of two modules at the same time

  void run_for(Duration duration) {
    const Instant end = now + duration;
    flush();
    for (;;) {
      const Instant next = std::min(bus.deadline(), arrivals_.empty() ? kNever : arrivals_.begin()->first);
      if (next > end) break;
      now = std::max(now, next);
      if (!arrivals_.empty() && arrivals_.begin()->first <= now) {
        const Bytes bytes = arrivals_.begin()->second.bytes;
        arrivals_.erase(arrivals_.begin());
        bus.receive(bytes, now);
      } else {
        bus.advance(now);
        ASSERT_GT(bus.deadline(), now) << "no progress";
      }
      flush();
    }
    now = end;
  }
  void connect() {
    bus.connect_anew(now);
    run_for(3s);
    for (std::size_t i = 0; i < bus.size(); ++i) {
      ASSERT_EQ(bus.module(i).state(), State::ready) << i << bus.module(i).failure();
    }
  }
  void spin(std::size_t i, double speed) {
    bus.module(i).spin_at(RadPerSec(speed), now);
    bus.advance(now);
    flush();
  }
  std::vector<Reading> readings(std::size_t i) {
    std::vector<Reading> all(5000);
    all.resize(bus.module(i).take(all));
    return all;
  }

 private:
  struct Reply {
    std::size_t module;
    Bytes bytes;
  };
  static std::vector<Settings> settings_of(const std::vector<int>& ids) {
    std::vector<Settings> all(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) all[i].module_id = ids[i];
    return all;
  }
  void flush() {
    for (auto output = bus.output(); !output.empty(); output = bus.output()) {
      const Bytes sent(output.begin(), output.end());
      bus.sent(sent.size());
      for (std::size_t i = 0; i < modules.size(); ++i) {
        for (const Bytes& reply : modules[i].receive(sent)) {
          for (const auto& [time, other] : arrivals_) collisions += other.module != i ? 1 : 0;
          arrivals_.emplace(now + 2ms, Reply{i, reply});
        }
      }
    }
  }
  std::multimap<Instant, Reply> arrivals_;
};

TEST(Bus, RefusesTwoModulesWithOneIdAndNone) {
  EXPECT_THROW(Bus({}), std::invalid_argument);
  EXPECT_THROW(Bus(std::vector<Settings>(2)), std::invalid_argument);
}

TEST(Bus, ConnectsAllAndBringsEachItsOwnReadings) {
  Line line({0, 5, 62});
  line.connect();
  line.run_for(1s);
  for (std::size_t i = 0; i < 3; ++i) {
    int speeds = 0;
    for (const Reading& reading : line.readings(i)) {
      if (reading.quantity != Quantity::speed) continue;
      ++speeds;
      EXPECT_EQ(reading.value, 100 + line.modules[i].id);
    }
    EXPECT_GT(speeds, 150) << i;
    EXPECT_EQ(line.bus.module(i).counters().wrong_module, 0u) << "its neighbours' replies are no faults";
  }
}

TEST(Bus, NeverLetsTwoModulesReplyAtOnce) {
  Line line({1, 2, 3, 4});
  line.connect();
  line.spin(2, 500);
  line.run_for(5s);
  EXPECT_EQ(line.collisions, 0);
}

TEST(Bus, MovesOnlyTheModuleThatIsMeant) {
  Line line({1, 2});
  line.connect();
  line.spin(1, 700);
  line.run_for(100ms);
  EXPECT_EQ(line.modules[0].values.at({50, 0}), fake::u8(5));
  EXPECT_EQ(line.modules[1].values.at({50, 0}), fake::u8(3));
}

TEST(Bus, CoastsAllByBroadcastAndByTheirIds) {
  Line line({1, 2});
  line.connect();
  line.spin(0, 700);
  line.spin(1, 700);
  line.run_for(100ms);
  for (auto& module : line.modules) module.heard.clear();
  line.bus.emergency_stop(line.now);
  line.run_for(100ms);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& heard = line.modules[i].heard;
    EXPECT_EQ(std::count_if(heard.begin(), heard.end(), [](const auto& h) { return h.is_coast() && h.id == 63; }), 1);
    EXPECT_GE(std::count_if(heard.begin(), heard.end(),
                            [&](const auto& h) { return h.is_coast() && h.id == line.modules[i].id; }),
              3);
    EXPECT_TRUE(line.bus.module(i).coasting());
  }
}

TEST(Bus, StopsAllWhenOneDoesNotConfirmItsCoast) {
  Line line({1, 2});
  line.connect();
  line.spin(0, 700);
  line.spin(1, 700);
  line.run_for(100ms);
  line.modules[0].ignore_sets = true;
  line.bus.module(0).coast(line.now);
  line.run_for(2s);
  EXPECT_EQ(line.bus.module(0).state(), State::failed);
  EXPECT_EQ(line.bus.module(1).state(), State::failed);
  EXPECT_NE(line.bus.module(1).failure().find("module 1 on the same line"), std::string::npos);
  EXPECT_TRUE(line.modules[1].last_motion()->is_coast());
  EXPECT_TRUE(line.bus.module(1).coasting());
}

TEST(Bus, StopsAllWhenOneStopsAnswering) {
  Line line({1, 2});
  line.connect();
  line.spin(1, 700);
  line.modules[0].mute = true;
  line.run_for(5s);
  EXPECT_EQ(line.bus.module(0).state(), State::failed);
  EXPECT_TRUE(line.modules[1].last_motion()->is_coast());
}

}  // namespace
}  // namespace kphi::iq
