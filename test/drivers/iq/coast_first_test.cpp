// A coast goes before everything that waits for the module: behind the frame that has begun come the coasts, and no
// speed comes after them. Whatever waits, and wherever the line stopped taking bytes.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <memory>
#include <random>

#include "drivers/iq/link/motor.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"
#include "test/drivers/iq/wire.hpp"
#include "test/soon.hpp"

namespace kphi::iq {
namespace coast_first_test {

using namespace std::chrono_literals;
using fake::Bytes;
using fake::Module;
using fake::Wire;
using Random = std::mt19937;

constexpr std::size_t kCoasts = 3;  // of an emergency stop
constexpr std::size_t kAround = 5;  // bytes of a frame around its payload, which has two before its data

std::size_t below(Random& random, std::size_t limit) { return random() % limit; }

/// The far end of a line that takes bytes when the test says so.
class SlowLine {
 public:
  /// Takes the first `n` of what waits, fewer if there are fewer.
  template <class Source>
  void take(Source& source, std::span<const std::uint8_t> waiting, std::size_t n) {
    n = std::min(n, waiting.size());
    module_.receive(waiting.first(n));
    taken_ += n;
    source.sent(n);
  }
  /// Frames that have left or begun to leave.
  [[nodiscard]] std::size_t begun() const {
    std::size_t whole = 0;
    for (const fake::QueryResult& frame : module_.heard) whole += frame.data.size() + 2 + kAround;
    return module_.heard.size() + (taken_ > whole ? 1 : 0);
  }
  [[nodiscard]] const std::vector<fake::QueryResult>& heard() const { return module_.heard; }

 private:
  Module module_;
  std::size_t taken_ = 0;
};

/// `begun`: frames that had left or begun to leave when the motor was to stop.
void expect_coast_first(const std::vector<fake::QueryResult>& heard, std::size_t begun) {
  ASSERT_GE(heard.size(), begun + kCoasts);
  for (std::size_t i = begun; i < heard.size(); ++i) {
    if (i < begun + kCoasts) {
      ASSERT_TRUE(heard[i].is_coast()) << "frame " << i - begun << " after the stop is " << heard[i].type << "."
                                       << heard[i].sub;
    }
    ASSERT_FALSE(heard[i].is_speed()) << "a speed " << i - begun << " frames after the stop";
  }
}

Packet packet_of(TxQueue::Kind kind, Random& random) {
  if (kind == TxQueue::Kind::motion)
    return make(entry<"propeller_motor_control.ctrl_velocity">, Access::set, 0, 100.0 + below(random, 1000));
  if (kind == TxQueue::Kind::setting) return make(entry<"propeller_motor_control.timeout">, Access::set, 0, 0.5);
  return make(entry<"brushless_drive.obs_velocity">, Access::get, 0);
}

TEST(CoastFirst, OfAnOutboxWithWhateverWaitsInIt) {
  constexpr TxQueue::Kind kKinds[] = {TxQueue::Kind::request, TxQueue::Kind::setting, TxQueue::Kind::motion};
  int full = 0, begun = 0;
  for (unsigned seed = 1; seed <= 2000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    TxQueue tx_queue;
    SlowLine line;
    bool has_room = true;
    for (std::size_t left = below(random, 60); left > 0 && has_room; --left) {
      const TxQueue::Kind kind = kKinds[below(random, 3)];
      has_room = tx_queue.push(kind, packet_of(kind, random));
      if (below(random, 4) == 0) line.take(tx_queue, tx_queue.bytes(), below(random, 12));
    }
    full += has_room ? 0 : 1;
    begun += line.begun() > line.heard().size() ? 1 : 0;
    const std::size_t before = line.begun();
    const Packet coast = make(entry<"propeller_motor_control.ctrl_coast">, Access::set, 0);
    for (std::size_t i = 0; i < kCoasts; ++i) tx_queue.push_coast(coast);
    while (!tx_queue.bytes().empty()) line.take(tx_queue, tx_queue.bytes(), 1 + below(random, 20));
    expect_coast_first(line.heard(), before);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(full, 200) << "stops with no room left";
  EXPECT_GT(begun, 200) << "stops in the midst of a frame";
}

TEST(CoastFirst, OfASessionWhosePollsSettingsAndSpeedsWait) {
  int with_settings = 0, with_speeds = 0;
  std::size_t most_waiting = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Settings settings;
    settings.telemetry_hz = 200;
    settings.every_cycle = {MotorChannel::speed, MotorChannel::motor_current, MotorChannel::supply_voltage};
    settings.credit_bytes = 18 + below(random, 250);
    Wire wire(settings);
    wire.connect();
    Session& session = wire.session;
    SlowLine line;
    const Instant ends = wire.now + 40ms;
    for (bool asked = false; wire.now < ends; wire.now += std::chrono::microseconds(below(random, 3000))) {
      session.advance(wire.now);
      if (below(random, 3) == 0) session.spin_at(RadPerSec(100.0 + below(random, 1000)), wire.now);
      if (!asked && below(random, 4) == 0) {
        session.inquire({{&entry<"propeller_motor_control.velocity_Kp">, 0.002},
                         {&entry<"propeller_motor_control.velocity_Ki">, 0.001},
                         {&entry<"propeller_motor_control.velocity_Kd">, 0.0}},
                        wire.now);
        asked = true;
      }
      if (below(random, 5) == 0) line.take(session, session.output(), below(random, 10));
    }
    Module waiting;
    const std::size_t before = line.begun();
    waiting.receive(session.output());
    with_settings += waiting.count([](const auto& m) { return m.access == 1 && !m.is_motion(); }) > 0 ? 1 : 0;
    with_speeds += waiting.count([](const auto& m) { return m.is_speed(); }) > 0 ? 1 : 0;
    most_waiting = std::max(most_waiting, waiting.heard.size());

    session.emergency_stop(wire.now);
    for (int i = 0; i < 60; ++i, wire.now += std::chrono::microseconds(below(random, 500))) {
      line.take(session, session.output(), 1 + below(random, 20));
      session.advance(wire.now);
    }
    expect_coast_first(line.heard(), before);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(with_settings, 50);
  EXPECT_GT(with_speeds, 50);
  EXPECT_GE(most_waiting, 8u) << "a speed itself waits for the module's word";
}

/// What is on its way is ahead of anything: here the line is full of frames that nobody else sends.
class FullLine {
 public:
  explicit FullLine(const fake::ModuleOnALine& line)
      : module_end_(line.master()),
        host_end_(::open(line.device().c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK)) {}
  ~FullLine() { ::close(host_end_); }
  FullLine(const FullLine&) = delete;
  FullLine& operator=(const FullLine&) = delete;
  /// True once not a byte more fits; before, the terminal moves bytes on within itself, which makes room.
  [[nodiscard]] bool fill() const {
    write_all_that_fits();
    int readable = 0;
    ::ioctl(module_end_, FIONREAD, &readable);
    write_all_that_fits();
    return readable == kReadable;
  }
  /// Frames up to the last of them.
  [[nodiscard]] static std::size_t ahead(const std::vector<fake::QueryResult>& heard) {
    std::size_t n = heard.size();
    while (n > 0 && heard[n - 1].type != kNobodys) --n;
    return n;
  }

 private:
  void write_all_that_fits() const {
    const Bytes frame = fake::message(kNobodys, 0, 0, 0);
    for (std::size_t n = frame.size(); n > 0; n = n == 1 ? 0 : 1) {
      while (::write(host_end_, frame.data(), n) > 0) {
      }
    }
  }

  static constexpr int kNobodys = 200;
  static constexpr int kReadable = 4095;  // of a terminal of Linux, at most
  int module_end_, host_end_;
};

TEST(CoastFirst, OfALinkWhoseLineTakesNoBytes) {
  const SteadyClock clock;
  fake::ModuleOnALine line;
  const FullLine full(line);
  Settings settings;
  settings.telemetry_hz = 200;
  Motor motor(line.device(), 115200, settings, clock);
  motor.spin_at(RadPerSec(500));
  ASSERT_TRUE(line.heard_a_speed(500));
  line.with([&](Module&) {  // which hears nothing meanwhile
    const auto before = motor.counters();
    const auto polls_wait = [&] { return full.fill() && motor.counters().timeouts > before.timeouts; };
    ASSERT_TRUE(test::soon(polls_wait));
    motor.spin_at(RadPerSec(600));
    motor.emergency_stop();
    ASSERT_TRUE(test::soon([&] { return motor.counters().coasts >= before.coasts + kCoasts; }));
  });
  ASSERT_TRUE(motor.stop().safe());
  line.with([&](Module& module) {
    const std::size_t first = FullLine::ahead(module.heard);
    ASSERT_GT(first, 0u);
    const bool begun = first < module.heard.size() && !module.heard[first].is_coast();
    expect_coast_first(module.heard, first + (begun ? 1 : 0));
  });
}

}  // namespace coast_first_test
}  // namespace kphi::iq
