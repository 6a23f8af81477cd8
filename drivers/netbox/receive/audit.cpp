#include "drivers/netbox/receive/audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/device_data.hpp"

namespace kphi::netbox {
namespace {

using Findings = std::vector<Finding>;

const char* unit_of(std::size_t axis) { return axis < 3 ? "N" : "N m"; }

void check_stream(const Configuration& box, const Intention& intention, Findings& found) {
  if (!box.rdt_enabled)
    found.push_back({Severity::fault, "RDT is disabled (comrdte)", "enable RDT on the box's Communications page"});
  if (intention.rate_hz > 0 && std::abs(box.rdt_rate_hz - intention.rate_hz) > 0.5)
    found.push_back({Severity::fault,
                     fmt::format("the box streams at {:.4g} Hz, the bench file expects {:g} Hz", box.rdt_rate_hz,
                                 intention.rate_hz),
                     "set the RDT output rate on the box's Communications page, or rate_hz in the bench file"});
  const double cutoff = filter_cutoff_hz(box).value_or(0);
  std::vector<std::string> lines;
  for (const AliasedLine& line :
       aliased_lines(box.rdt_rate_hz, intention.speeds_rpm, intention.blades, intention.alias_limit_hz)) {
    if (cutoff > 0 && line.true_hz > cutoff) continue;
    lines.push_back(fmt::format("{:.1f} RPM ({} at {:.2f} Hz appears at {:.2f} Hz)", line.speed_rpm,
                                line.per_revolution == 1 ? "1/rev" : fmt::format("{}-blade pass", line.per_revolution),
                                line.true_hz, line.apparent_hz));
  }
  if (!lines.empty())
    found.push_back({Severity::fault,
                     fmt::format("at {:.4g} Hz a rotor harmonic aliases to a constant force at these steps: {}",
                                 box.rdt_rate_hz, fmt::join(lines, ", ")),
                     "set the RDT output rate to 7000 Hz"});
}

void check_scale(const Configuration& box, const Intention& intention, Findings& found) {
  constexpr double kCoarse = 0.001;  // of the largest thrust: a box set to lbf or kgf counts in whole units
  const double count_n = 1 / box.counts_per_newton;
  if (intention.largest_thrust_n > 0 && count_n > kCoarse * intention.largest_thrust_n)
    found.push_back({Severity::fault,
                     fmt::format("resolution too coarse: one count is {:.3g} N, the largest thrust {:g} N", count_n,
                                 intention.largest_thrust_n),
                     "choose N as the force unit on the box's Configurations page"});
  const auto axis = static_cast<std::size_t>(std::clamp(intention.thrust_axis, 0, 2));
  const double expected = intention.largest_thrust_n, range = box.range[axis];
  if (expected > 0.8 * range)
    found.push_back({expected >= range ? Severity::fault : Severity::warning,
                     fmt::format("{:g} N expected on {}, its range is {:g} N", expected, kAxisNames[axis], range),
                     "choose a calibration with a larger range on the box's Configurations page, or lower the speeds"});
}

void check_sampling(const Configuration& box, const Intention& intention, Findings& found) {
  const auto warn = [&](std::string what, const char* next_move) {
    found.push_back({Severity::warning, std::move(what), next_move});
  };
  if (intention.records_per_datagram > 0 && box.records_per_datagram != intention.records_per_datagram)
    warn(fmt::format("the box sends {} records per datagram, the bench file expects {}", box.records_per_datagram,
                     intention.records_per_datagram),
         "set the RDT buffer size on the box's Communications page, or records_per_datagram in the bench file");
  const auto cutoff = filter_cutoff_hz(box);
  if (cutoff.value_or(0) > box.rdt_rate_hz / 2)
    warn(fmt::format("the filter's cutoff, {:g} Hz, is above half the rate, {:.4g} Hz: vibration between the two "
                     "aliases into the measurement",
                     *cutoff, box.rdt_rate_hz / 2),
         "raise the RDT output rate to 7000 Hz, or choose a lower filter on the box's Settings page");
  if (box.filter_code == 0 && box.divisor != 1 && intention.speeds_rpm.empty())
    warn(fmt::format("{:.4g} Hz without a filter: the box drops samples, so vibration aliases into the measurement",
                     box.rdt_rate_hz),
         "set the RDT output rate to 7000 Hz");
  if (!cutoff)
    warn(fmt::format("the cutoff of filter {} of this product is unknown: aliasing cannot be checked", box.filter_code),
         "switch the filter off on the sensor's Settings page");
  const double period_s = box.records_per_datagram / box.rdt_rate_hz;
  if (period_s > 0.25)
    warn(fmt::format("a datagram takes {:.1f} s to fill ({} records at {:.4g} Hz)", period_s, box.records_per_datagram,
                     box.rdt_rate_hz),
         "raise the RDT output rate or lower the RDT buffer size on the box's Communications page");
}

void check_extras(const Configuration& box, Findings& found) {
  const auto any = [](const std::array<double, 6>& values) {
    return std::ranges::any_of(values, [](double value) { return value != 0; });
  };
  const std::span transform(box.tool_transform);
  if (any(box.tool_transform))
    found.push_back({Severity::note,
                     fmt::format("the box applies a tool transform ({:g} {}, {:g} {}): torques are about that point",
                                 fmt::join(transform.first(3), " "), box.tool_distance_unit,
                                 fmt::join(transform.last(3), " "), box.tool_angle_unit),
                     "do not apply the offset again"});
  if (any(box.gage_bias))
    found.push_back(
        {Severity::note, "a gage bias is set in the box (setbias): forces are relative to it", "tare before each run"});
  if (!box.monitoring || !box.monitor_conditions || box.monitor_conditions->empty()) return;
  std::vector<std::string> list;
  for (const MonitorCondition& c : *box.monitor_conditions) {
    const auto axis = static_cast<std::size_t>(c.axis);
    list.push_back(fmt::format("{} {} {:g} {}", kAxisNames[axis], c.above ? '>' : '<', c.threshold, unit_of(axis)));
  }
  found.push_back({Severity::note,
                   fmt::format("the box checks these monitor conditions at 7 kHz: {}", fmt::join(list, ", ")),
                   "once one was true, the status shows \"monitor condition\" until it is reset"});
}

}  // namespace

std::vector<AliasedLine> aliased_lines(double rate_hz, std::span<const double> speeds_rpm, int blades,
                                       double limit_hz) {
  std::vector<AliasedLine> lines;
  for (const double speed : speeds_rpm) {
    for (const int per_revolution : {1, blades}) {
      if (per_revolution < 1) continue;
      const double true_hz = per_revolution * speed / 60;
      const double apparent_hz = std::abs(true_hz - rate_hz * std::round(true_hz / rate_hz));
      if (true_hz > rate_hz / 2 && apparent_hz < limit_hz)
        lines.push_back({speed, per_revolution, true_hz, apparent_hz});
    }
  }
  return lines;
}

std::vector<Finding> audit(const Configuration& box, const Intention& intention) {
  Findings found;
  check_stream(box, intention, found);
  check_scale(box, intention, found);
  check_sampling(box, intention, found);
  check_extras(box, found);
  put_worst_first(found);
  return found;
}

}  // namespace kphi::netbox
