#include "drivers/netbox/receive/bias.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <vector>

#include "base/error.hpp"
#include "drivers/netbox/wire/status.hpp"

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;
using SteadyTime = std::chrono::steady_clock;

constexpr int kMostDraws = 3;
constexpr const char* kAxes[] = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};

/// Calls `use` for each record that comes until it answers false.
template <class Use>
void take_while(LoadCell& cell, std::chrono::nanoseconds wall_timeout, const char* operation, Use&& use) {
  const auto deadline = SteadyTime::now() + wall_timeout;
  std::vector<StampedRecord> one(1);
  for (;;) {
    if (cell.take(one) == 1) {
      if (!use(one[0])) return;
      continue;
    }
    const auto left = deadline - SteadyTime::now();
    if (left <= 0ns || !cell.wait(left)) {
      throw DeviceError("Net Box", operation, "the records do not come in time",
                        "see whether the stream is silent: kphi devices");
    }
  }
}

/// The bias, and the wait for what the box still sends of the old zero: on its way, in its buffer, in its filter.
void draw(LoadCell& cell, const Clock& clock, std::chrono::nanoseconds wall_timeout) {
  const Configuration& box = cell.configuration();
  const Instant worked =
      clock.now() + clock.stretched(100ms) + from_seconds(3 * box.records_per_datagram / box.rdt_rate_hz);
  cell.set_bias();
  take_while(cell, wall_timeout, "set the bias",
             [&](const StampedRecord& stamped) { return stamped.arrival < worked; });
}

double allowed_on(std::size_t axis, BiasTolerance tolerance) {
  return axis < 3 ? tolerance.force_n : tolerance.torque_nm;
}

std::optional<std::size_t> axis_beyond(const ZeroMeasurement& zero, BiasTolerance tolerance) {
  for (std::size_t axis = 0; axis < 6; ++axis)
    if (!(std::abs(zero.mean[axis]) < allowed_on(axis, tolerance))) return axis;
  return std::nullopt;
}

[[noreturn]] void refuse(const BiasStep& step, std::size_t axis, BiasTolerance tolerance) {
  const char* unit = axis < 3 ? "N" : "Nm";
  throw DeviceError(
      "Net Box", "set the bias",
      fmt::format("{} is {:.4g} {} afterwards, {:g} {} are tolerated (it was {:.4g} {})", kAxes[axis],
                  step.after.mean[axis], unit, allowed_on(axis, tolerance), unit, step.before.mean[axis], unit),
      "let the stand come to rest and try again; another client may have set its own bias");
}

}  // namespace

void ZeroEstimate::add(const StampedRecord& stamped) noexcept {
  if (!healthy(stamped.record.status)) {
    ++refused_;
    return;
  }
  if (records_++ == 0) first_ = stamped.arrival;
  last_ = stamped.arrival;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double difference = stamped.record.counts[axis] - mean_[axis];
    mean_[axis] += difference / static_cast<double>(records_);
    squares_[axis] += difference * (stamped.record.counts[axis] - mean_[axis]);
  }
}

ZeroMeasurement ZeroEstimate::result(const Configuration& scale) const noexcept {
  ZeroMeasurement zero;
  zero.records = records_;
  zero.refused = refused_;
  zero.first = first_;
  zero.last = last_;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double counts_per_unit = axis < 3 ? scale.counts_per_newton : scale.counts_per_newton_metre;
    zero.mean[axis] = mean_[axis] / counts_per_unit;
    if (records_ > 1)
      zero.standard_deviation[axis] = std::sqrt(squares_[axis] / static_cast<double>(records_ - 1)) / counts_per_unit;
  }
  return zero;
}

ZeroMeasurement measure_zero(LoadCell& cell, std::uint64_t records, std::chrono::nanoseconds wall_timeout) {
  ZeroEstimate estimate;
  take_while(cell, wall_timeout, "measure the zero", [&](const StampedRecord& stamped) {
    estimate.add(stamped);
    return estimate.records() < records;
  });
  return estimate.result(cell.configuration());
}

BiasStep take_bias(LoadCell& cell, const Clock& clock, std::uint64_t records, BiasTolerance tolerance,
                   std::chrono::nanoseconds wall_timeout) {
  BiasStep step;
  step.before = measure_zero(cell, records, wall_timeout);
  const std::uint64_t restarts = cell.counters().restarts;
  for (step.draws = 1;; ++step.draws) {
    draw(cell, clock, wall_timeout);
    step.after = measure_zero(cell, records, wall_timeout);
    step.stream_restarted = cell.counters().restarts != restarts;
    const auto axis = axis_beyond(step.after, tolerance);
    if (!axis) return step;
    if (step.draws == kMostDraws) refuse(step, *axis, tolerance);
  }
}

}  // namespace kphi::netbox
