// The hot paths whose instructions `./run counts` compares with counts.txt. Each path prepares its input from a fixed
// seed, runs once to allocate and fill what it keeps, and once more for callgrind, which writes one dump per path. One
// thread, no clock, no file. Prints "name units unit" for each path; without valgrind it counts nothing.
#include <fmt/format.h>
#include <valgrind/callgrind.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "base/random.hpp"
#include "compensation/compensator.hpp"
#include "compensation/mixing.hpp"
#include "compensation/occlusion.hpp"
#include "daq/guard/guard.hpp"
#include "drivers/iq/exchange/exchange.hpp"
#include "drivers/netbox/stream/session.hpp"
#include "drivers/sim/simulated_bench.hpp"
#include "fit/model/identification.hpp"
#include "results/reduction/reduction.hpp"
#include "test/compensation/example_vehicle.hpp"
#include "test/daq/queue_bench.hpp"
#include "test/drivers/netbox/record_bytes.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::counts {
namespace {

using std::chrono::milliseconds;

/// Does the path's work and returns how many units of it succeeded.
using Work = std::function<std::size_t()>;

struct Path {
  const char* name;
  const char* unit;
  std::size_t units;  ///< of one run
  Work (*prepare)();
};

/// Keeps the compiler from removing the computation of `value`.
template <class T>
void use(const T& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

// The load cell's stream, as netbox::Connection receives it.

using Datagrams = std::vector<netbox::test::Bytes>;

/// Records numbered from 1, with noise in Fz.
Datagrams datagrams(std::size_t count, unsigned records_each) {
  Random random(1);
  Datagrams all(count);
  std::uint32_t number = 0;
  for (netbox::test::Bytes& bytes : all) {
    for (unsigned i = 0; i < records_each; ++i) {
      ++number;
      netbox::test::put_record(bytes, number, number, 0, static_cast<std::int32_t>(30'000 * random.normal()));
    }
  }
  return all;
}

std::size_t received(const Datagrams& all, unsigned records_each) {
  netbox::StreamSettings settings;
  settings.records_per_datagram = static_cast<int>(records_each);
  netbox::Session session(settings);
  session.start(Instant{0});
  Instant now = session.deadline();
  session.advance(now);
  std::array<LoadCellRecord, netbox::kMaxRecords> slots;
  std::vector<LoadCellRecord> accepted;
  std::size_t delivered = 0;
  for (const netbox::test::Bytes& datagram : all) {
    now += settings.datagram_period();
    const auto room = std::span(slots).first(netbox::records_in(datagram.size()));
    if (session.receive_in_order(datagram, now, room)) {
      delivered += room.size();
      continue;
    }
    session.receive(datagram, now, accepted);
    delivered += accepted.size();
    accepted.clear();
  }
  session.flush(accepted);
  return delivered + accepted.size();
}

constexpr std::size_t kDecoded = 40'000, kReordered = 20'000;

Work decode() {
  return [all = datagrams(kDecoded / 40, 40)] { return received(all, 40); };
}

/// Of eight neighbouring datagrams two have changed places.
Work reorder() {
  Datagrams all = datagrams(kReordered / 10, 10);
  SplitMix64 draw(2);
  for (std::size_t first = 8; first + 8 <= all.size(); first += 8) {
    const std::size_t overtaken = first + draw.below(7);
    std::swap(all[overtaken], all[overtaken + 1]);
  }
  return [all = std::move(all)] { return received(all, 10); };
}

// The motor module's replies.

constexpr std::size_t kCycles = 2000;
constexpr std::array<const iq::Entry*, 4> kAsked{&iq::entry<"brushless_drive.obs_velocity">,
                                                 &iq::entry<"brushless_drive.est_motor_amps">,
                                                 &iq::entry<"power_monitor.volts">, &iq::entry<"power_monitor.amps">};

/// Four questions, then their answers; the last answer arrives in two pieces.
Work reply() {
  Random random(3);
  std::vector<std::vector<std::uint8_t>> answers(kCycles);
  for (auto& bytes : answers) {
    for (const iq::Entry* entry : kAsked) {
      std::array<std::uint8_t, iq::kMaxFrame> frame;
      const std::size_t size = iq::encode(iq::make(*entry, iq::Access::reply, 0, 1000 + random.normal()), frame);
      bytes.insert(bytes.end(), frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size));
    }
  }
  return [answers = std::move(answers)] {
    iq::Exchange exchange(iq::completed({}));
    Instant now{0};
    std::size_t values = 0;
    const auto take = [&](std::span<const std::uint8_t> bytes) {
      for (const iq::QueryResult& result : exchange.receive(bytes, now += milliseconds(1)))
        values += std::isfinite(result.value()) ? 1 : 0;
    };
    for (const auto& bytes : answers) {
      for (const iq::Entry* entry : kAsked)
        if (!exchange.ask(*entry, 0, now)) return values;
      exchange.sent(exchange.output().size());
      const std::size_t first = bytes.size() - 5;
      take(std::span(bytes).first(first));
      take(std::span(bytes).subspan(first));
      use(exchange.advance(now += milliseconds(1)));
    }
    return values;
  };
}

// From samples to k(φ).

constexpr std::size_t kSteps = 6;

/// A run of six steps of 1.5 s, with its zeros, at 7 kHz in datagrams of 40 records.
Work reduction() {
  results::test::Truth truth;
  truth.rate_hz = 7000;
  truth.ft_stride = 1;
  truth.speeds = {300, 500, 700, 900, 1100, 1300};
  truth.dwell_s = 1.5;
  truth.correlated_n = 0.005;
  truth.speed_noise_rad_s = 0.2;
  truth.thrust_delay_s = 0.02;
  truth.reading_phase_s = 0.007;
  truth.records_per_datagram = 40;
  auto run = results::test::make_run(truth);
  run.header.minimum_discard_s = 0.5;
  return [run = std::move(run)] { return results::reduce(run).size(); };
}

constexpr double kOcclusion = 90;

/// 40 levels in three runs of one occlusion; the levels below 3000 RPM do not enter the fit.
Work fit() {
  std::vector<results::StepMean> steps;
  for (const results::StepMean& step : fit::campaign_steps())
    if (step.occlusion_deg == kOcclusion && step.speed_rad_s > fit::IdentificationOptions{}.speed_range.min_rad_s)
      steps.push_back(step);
  return [steps = std::move(steps)] {
    fit::IdentificationOptions options;
    options.loss = fit::Loss::huber;
    fit::Repeatability repeatability;
    const auto table = fit::coefficients_of(steps, options, steps.back().commanded_speed_rad_s, repeatability);
    return std::abs(table.front().k / fit::CampaignTruth{}.k(kOcclusion) - 1) < 0.01 ? table.size() : 0;
  };
}

constexpr std::size_t kLines = 100;

/// The line, whether k(φ) is one, and the curve that flies.
Work line() {
  std::vector<fit::CurvePoint> points;
  const fit::CampaignTruth truth;
  for (const double phi : {0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0})
    points.push_back({phi, truth.k(phi), 1e-3 * truth.K_T});
  return [points = std::move(points)]() mutable {
    std::size_t lines = 0;
    for (std::size_t i = 0; i < kLines; ++i) {
      points[1 + i % 6].k *= i % 12 < 6 ? 1.001 : 1 / 1.001;
      const fit::CurveFit found = fit::fit_curve(points);
      use(found.tested(20));
      use(found.curve());
      lines += found.residuals.size() == 6 ? 1 : 0;
    }
    return lines;
  };
}

// The guard, in batches of 5 ms.

constexpr std::size_t kBatches = 100, kBatch = 35;

/// Limits that no value reaches, for everything except the heartbeats of the runner.
std::vector<daq::GuardLimit> far_limits() {
  std::vector<daq::GuardLimit> table;
  for (const daq::GuardedQuantity& row : daq::kQuantities) {
    if (row.source == daq::Source::runner) continue;
    const bool lower = row.sense == daq::Sense::lower;
    table.push_back({row.watched, "", lower ? -1e9 : 1e9, "", "", lower});
  }
  return table;
}

/// The guard between devices and recorder: each sample and reading is judged and passed on.
class Watched {
 public:
  Watched() : guard_(bench_, {}, daq::mini40(), far_limits(), 3) {
    guard_.take_zero({});
    Random random(4);
    for (std::size_t i = 0; i < kBatches * kBatch; ++i) {
      LoadCellRecord record = daq::load_of(9 + 0.03 * random.normal(), 0.1 + 0.001 * random.normal());
      record.counts[0] = static_cast<std::int32_t>(30'000 * random.normal());
      record.counts[1] = static_cast<std::int32_t>(30'000 * random.normal());
      samples_.push_back(record);
    }
  }

  /// Half a second at 7 kHz, with motor readings every 20 ms.
  std::size_t watch() {
    std::array<LoadCellRecord, kBatch> recorded;
    std::array<MotorReading, 16> readings;
    std::size_t judged = 0;
    for (std::size_t batch = 0; batch < kBatches; ++batch) {
      now_ += milliseconds(5);
      bench_.time.set(now_);
      for (std::size_t i = 0; i < kBatch; ++i) {
        LoadCellRecord sample = samples_[batch * kBatch + i];
        sample.ft_sequence = sample.rdt_sequence = ++sequence_;
        sample.arrival_ns = now_.count();
        bench_.records.push_back(sample);
      }
      if (batch % 4 == 0) {
        bench_.readings.push_back({MotorChannel::speed, now_.count(), 300'000, 1000});
        bench_.readings.push_back({MotorChannel::motor_current, now_.count(), 300'000, 12});
        bench_.readings.push_back({MotorChannel::supply_voltage, now_.count(), 300'000, 12});
        bench_.readings.push_back({MotorChannel::fault_now, now_.count(), 300'000, 0});
      }
      (void)guard_.relay();
      judged += guard_.take(recorded);
      use(guard_.take(readings));
    }
    return guard_.latch().trip() == nullptr ? judged : 0;
  }

 private:
  daq::QueueBench bench_;
  daq::Guard guard_;
  std::vector<LoadCellRecord> samples_;
  Instant now_{0};
  std::uint32_t sequence_ = 0;
};

Work observation() {
  return [watched = std::make_shared<Watched>()] { return watched->watch(); };
}

// The library that flies.

using compensation::Compensator;
constexpr std::size_t kShapes = 500, kDemands = 2000, kCommands = 10'000;

/// The arms on their way from X, where the body covers no propeller, to O; each at an angle of its own.
std::array<Radians, 4> shape_between(std::size_t i) {
  const double share = static_cast<double>(i) / kShapes;
  return compensation::arms_at(45 + 135 * share, 46 + 134 * share, 47 + 133 * share, 44 + 136 * share);
}

Work set_arms() {
  return [compensator = compensation::example_compensator()]() mutable {
    std::size_t covered = 0;
    for (std::size_t i = 0; i < kShapes; ++i) {
      compensator.set_arms(shape_between(i));
      use(compensator);
      covered += compensator.scaling_factors()[0] > 0 ? 1 : 0;
    }
    return covered;
  };
}

/// An octagonal body, by all three measures of φ.
Work geometry() {
  compensation::Airframe frame = compensation::example_airframe();
  frame.polygon =
      compensation::PolygonBody{compensation::regular_polygon(8, 0.06), compensation::Rotors<compensation::Hinge>(4)};
  for (std::size_t i = 0; i < 4; ++i) {
    const compensation::ConvexPolygon& outline = frame.polygon->outline;
    frame.polygon->hinges[i] = {outline.corner(2 * i), Radians(kPi / 2 * static_cast<double>(i) - kPi / 4), false};
  }
  return [frame]() mutable {
    std::size_t known = 0;
    for (std::size_t i = 0; i < kShapes; ++i) {
      frame.overlap = compensation::kOverlapMeasureNames[i % 3].measure;
      const auto arms = shape_between(i);
      for (std::size_t arm = 0; arm < arms.size(); ++arm)
        known += compensation::occlusion_of_arm(frame, arm, arms[arm]).value() >= 0 ? 1 : 0;
    }
    return known;
  };
}

/// Every third demand may be beyond the limits of the rotors.
Work mix() {
  Random random(5);
  std::vector<compensation::Wrench> demands;
  for (std::size_t i = 0; i < kDemands; ++i) {
    const double much = i % 3 == 2 ? 8 : 1;
    demands.push_back({Newtons(6 + much * random.symmetric()), NewtonMetres(0.03 * much * random.symmetric()),
                       NewtonMetres(0.03 * much * random.symmetric()), NewtonMetres(0.01 * much * random.symmetric())});
  }
  const auto mixer =
      compensation::Mixer::build(compensation::example_layout(compensation::shape_o()), {Metres(0.0133), 0.0});
  return [demands = std::move(demands), mixer = *mixer] {
    const compensation::ThrustLimits limits{{}, compensation::thrusts_of(5.2, 5.2, 5.6, 5.2)};
    std::size_t mixed = 0;
    for (const compensation::Wrench& demand : demands) mixed += mixer.mix(demand, limits).thrusts.size() == 4 ? 1 : 0;
    return mixed;
  };
}

Work speeds_for() {
  Random random(6);
  std::vector<std::array<Newtons, 4>> thrusts;
  const auto thrust = [&] { return 1.5 + 1.5 * random.symmetric(); };
  for (std::size_t i = 0; i < kCommands; ++i)
    thrusts.push_back(compensation::thrusts_of(thrust(), thrust(), thrust(), thrust()));
  return [thrusts = std::move(thrusts), compensator = compensation::with_arms(compensation::shape_o())] {
    std::size_t turning = 0;
    for (const auto& wanted : thrusts) turning += compensator.speeds_for(wanted).speeds[0].value() > 0 ? 1 : 0;
    return turning;
  };
}

// The simulated bench.

constexpr std::size_t kTicks = 7000;

/// One second of motor, propeller, load cell, box and wire; the motor is told a speed every 0.1 s.
Work tick() {
  return [] {
    sim::SimulatedBench bench{sim::BenchSettings{}};
    bench.mount("5x3", 45);
    bench.wire().request(netbox::encode_request(netbox::Command::buffered), 7, Instant{0});
    std::array<std::uint8_t, iq::kMaxFrame> frame;
    const std::size_t size =
        iq::encode(iq::make(iq::entry<"propeller_motor_control.ctrl_velocity">, iq::Access::set, 0, 1000), frame);
    sim::Datagram datagram;
    std::size_t sent = 0;
    Instant now{0};
    for (int ms = 0; ms < 1000; ++ms) {
      if (ms % 100 == 0) bench.motor_line().send(std::span(frame).first(size), now);
      bench.advance(now += milliseconds(1));
      while (bench.wire().next_datagram(datagram, now)) ++sent;
    }
    return sent == kTicks / 40 ? static_cast<std::size_t>(bench.ticks()) : 0;
  };
}

constexpr Path kPaths[] = {
    {"decode", "record", kDecoded, decode},
    {"reorder", "record", kReordered, reorder},
    {"reply", "reply", kCycles* kAsked.size(), reply},
    {"reduction", "step", kSteps, reduction},
    {"fit", "occlusion", 1, fit},
    {"line", "line", kLines, line},
    {"observation", "record", kBatches* kBatch, observation},
    {"set_arms", "call", kShapes, set_arms},
    {"geometry", "arm", 4 * kShapes, geometry},
    {"mix", "call", kDemands, mix},
    {"speeds_for", "call", kCommands, speeds_for},
    {"tick", "tick", kTicks, tick},
};

/// Returns false if the path did not do all of its work.
bool count(const Path& path) {
  const Work work = path.prepare();
  std::size_t done = work();
  if (done == path.units) {
    CALLGRIND_START_INSTRUMENTATION;
    CALLGRIND_ZERO_STATS;
    done = work();
    CALLGRIND_DUMP_STATS_AT(path.name);
    CALLGRIND_STOP_INSTRUMENTATION;
  }
  if (done != path.units) {
    fmt::print(stderr, "{}: {} of {} units done ({})\n", path.name, done, path.units, path.unit);
    return false;
  }
  fmt::print("{} {} {}\n", path.name, path.units, path.unit);
  return true;
}

}  // namespace
}  // namespace kphi::counts

int main() {
  bool complete = true;
  for (const auto& path : kphi::counts::kPaths) complete = kphi::counts::count(path) && complete;
  return complete ? 0 : 1;
}
