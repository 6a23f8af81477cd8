#include "drivers/netbox/receive/audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "drivers/netbox/receive/udp_socket.hpp"
#include "drivers/netbox/wire/rdt.hpp"

namespace kphi::netbox {
namespace {

using Check = std::optional<Finding> (*)(const Configuration&, const Intention&);

std::optional<Finding> rdt_disabled(const Configuration& box, const Intention&) {
  if (box.rdt_enabled) return std::nullopt;
  return Finding{Severity::fault, "RDT is disabled (comrdte)", "enable RDT on the box's Communications page"};
}

std::optional<Finding> empty_calibration(const Configuration& box, const Intention&) {
  if (box.calibration_serial != "FT0000") return std::nullopt;
  return Finding{Severity::fault, fmt::format("slot {} uses an empty calibration (FT0000)", box.slot),
                 "choose a calibration on the box's Configurations page"};
}

std::optional<Finding> other_rate(const Configuration& box, const Intention& intention) {
  if (intention.rate_hz <= 0 || std::abs(box.rdt_rate_hz - intention.rate_hz) <= 0.5) return std::nullopt;
  return Finding{
      Severity::fault,
      fmt::format("the box streams at {:.4g} Hz, the bench file says {:g} Hz", box.rdt_rate_hz, intention.rate_hz),
      "set the RDT output rate on the box's Communications page, or rate_hz in the bench file"};
}

std::optional<Finding> other_buffer(const Configuration& box, const Intention& intention) {
  if (intention.records_per_datagram <= 0 || box.records_per_datagram == intention.records_per_datagram)
    return std::nullopt;
  return Finding{Severity::warning,
                 fmt::format("the box sends {} records per datagram, the bench file says {}", box.records_per_datagram,
                             intention.records_per_datagram),
                 "set the RDT buffer size on the box's Communications page, or records_per_datagram in the bench file"};
}

std::optional<Finding> slow_datagrams(const Configuration& box, const Intention&) {
  const double period_s = box.records_per_datagram / box.rdt_rate_hz;
  if (period_s <= 0.25) return std::nullopt;
  return Finding{Severity::warning,
                 fmt::format("a datagram takes {:.1f} s to fill ({} records at {:.4g} Hz)", period_s,
                             box.records_per_datagram, box.rdt_rate_hz),
                 "raise the RDT output rate or lower the RDT buffer size on the box's Communications page"};
}

std::optional<Finding> filter_above_half_the_rate(const Configuration& box, const Intention&) {
  const double cutoff = filter_cutoff_hz(box).value_or(0);
  if (cutoff <= box.rdt_rate_hz / 2) return std::nullopt;
  return Finding{Severity::warning,
                 fmt::format("the filter's cutoff, {:g} Hz, is above half the rate, {:.4g} Hz: vibration between the "
                             "two aliases into the measurement",
                             cutoff, box.rdt_rate_hz / 2),
                 "raise the RDT output rate to 7000 Hz, or choose a lower filter on the box's Settings page"};
}

std::optional<Finding> unfiltered_low_rate(const Configuration& box, const Intention& intention) {
  if (box.filter_code != 0 || box.divisor == 1 || !intention.speeds_rpm.empty()) return std::nullopt;
  return Finding{
      Severity::warning,
      fmt::format("{:.4g} Hz without a filter: the box drops samples, so vibration aliases into the measurement",
                  box.rdt_rate_hz),
      "set the RDT output rate to 7000 Hz"};
}

std::optional<Finding> aliased_rotor(const Configuration& box, const Intention& intention) {
  const double cutoff = filter_cutoff_hz(box).value_or(0);
  std::vector<AliasedLine> lines =
      aliased_lines(box.rdt_rate_hz, intention.speeds_rpm, intention.blades, intention.alias_limit_hz);
  std::erase_if(lines, [&](const AliasedLine& line) { return cutoff > 0 && line.true_hz > cutoff; });
  if (lines.empty()) return std::nullopt;
  std::string list;
  for (const AliasedLine& line : lines) {
    list += fmt::format("{}{:.1f} RPM ({} at {:.2f} Hz appears at {:.2f} Hz)", list.empty() ? "" : ", ", line.speed_rpm,
                        line.per_revolution == 1 ? "1/rev" : fmt::format("{}-blade pass", line.per_revolution),
                        line.true_hz, line.apparent_hz);
  }
  return Finding{Severity::fault,
                 fmt::format("at {:.4g} Hz these steps are folded into a constant force: {}", box.rdt_rate_hz, list),
                 "set the RDT output rate to 7000 Hz"};
}

std::optional<Finding> narrow_range(double expected, double range, const char* axis, const char* unit) {
  if (expected <= 0.8 * range) return std::nullopt;
  return Finding{expected >= range ? Severity::fault : Severity::warning,
                 fmt::format("{:g} {} expected on {}, its range is {:g} {}", expected, unit, axis, range, unit),
                 "choose a calibration with a larger range on the box's Configurations page, or lower the speeds"};
}

/// A box set to lbf or kgf counts in whole units.
std::optional<Finding> coarse_counts(const Configuration& box, const Intention& intention) {
  constexpr double kCoarse = 0.001;  // of the largest thrust
  const double count_n = 1 / box.counts_per_newton;
  if (count_n <= kCoarse * intention.largest_thrust_n || intention.largest_thrust_n <= 0) return std::nullopt;
  return Finding{Severity::fault,
                 fmt::format("resolution too coarse: one count is {:.3g} N, the largest thrust {:g} N", count_n,
                             intention.largest_thrust_n),
                 "choose N as the force unit on the box's Configurations page"};
}

std::optional<Finding> narrow_force_range(const Configuration& box, const Intention& intention) {
  constexpr const char* kAxes[] = {"Fx", "Fy", "Fz"};
  const auto axis = static_cast<std::size_t>(std::clamp(intention.thrust_axis, 0, 2));
  return narrow_range(intention.largest_thrust_n, box.range[axis], kAxes[axis], "N");
}

std::optional<Finding> narrow_torque_range(const Configuration& box, const Intention& intention) {
  constexpr const char* kAxes[] = {"Tx", "Ty", "Tz"};
  const auto axis = static_cast<std::size_t>(std::clamp(intention.thrust_axis, 0, 2));
  return narrow_range(intention.largest_torque_nm, box.range[axis + 3], kAxes[axis], "Nm");
}

std::optional<Finding> tool_transform(const Configuration& box, const Intention&) {
  const auto& transform = box.tool_transform;
  if (std::all_of(transform.begin(), transform.end(), [](double value) { return value == 0; })) return std::nullopt;
  return Finding{Severity::note,
                 fmt::format("the box applies a tool transform ({:g} {:g} {:g} {}, {:g} {:g} {:g} {}): torques "
                             "are about that point",
                             transform[0], transform[1], transform[2], box.tool_distance_unit, transform[3],
                             transform[4], transform[5], box.tool_angle_unit),
                 "do not apply the offset again"};
}

std::optional<Finding> gage_bias(const Configuration& box, const Intention&) {
  if (std::all_of(box.gage_bias.begin(), box.gage_bias.end(), [](double value) { return value == 0; }))
    return std::nullopt;
  return Finding{Severity::note, "a gage bias is set in the box (setbias): forces are relative to it",
                 "tare before each run"};
}

std::optional<Finding> monitor_conditions(const Configuration& box, const Intention&) {
  constexpr const char* kAxes[] = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};
  if (!box.monitoring || !box.monitor_conditions || box.monitor_conditions->empty()) return std::nullopt;
  std::string list;
  for (const MonitorCondition& c : *box.monitor_conditions) {
    list += fmt::format("{}{} {} {:g} {}", list.empty() ? "" : ", ", kAxes[c.axis], c.above ? '>' : '<', c.threshold,
                        c.axis < 3 ? "N" : "Nm");
  }
  return Finding{Severity::note, fmt::format("the box checks these monitor conditions at 7 kHz: {}", list),
                 "once one was true, the status shows \"monitor condition\" until it is reset"};
}

std::optional<Finding> unknown_filter(const Configuration& box, const Intention&) {
  if (filter_cutoff_hz(box)) return std::nullopt;
  return Finding{
      Severity::warning,
      fmt::format("the cutoff of filter {} of this product is unknown: aliasing cannot be checked", box.filter_code),
      "switch the filter off on the sensor's Settings page"};
}

constexpr Check kChecks[] = {rdt_disabled,        empty_calibration, other_rate,
                             aliased_rotor,       coarse_counts,     narrow_force_range,
                             narrow_torque_range, other_buffer,      filter_above_half_the_rate,
                             unfiltered_low_rate, unknown_filter,    slow_datagrams,
                             tool_transform,      gage_bias,         monitor_conditions};

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

std::optional<Finding> small_receive_buffer(std::size_t receive_buffer_bytes, int records_per_datagram, double rate_hz,
                                            double time_scale) {
  if (receive_buffer_bytes >= kWantedReceiveBytes) return std::nullopt;
  const auto records = static_cast<std::size_t>(records_per_datagram);
  const std::size_t held = datagrams_held(receive_buffer_bytes, kRecordBytes * records) * records;
  const double tolerated_s = static_cast<double>(held) / rate_hz / time_scale;
  return Finding{tolerated_s < 0.5 ? Severity::warning : Severity::note,
                 fmt::format("the kernel grants {:.2f} MiB of receive buffer instead of {:.0f}: records are lost if "
                             "kphi is blocked for more than {:.0f} ms",
                             static_cast<double>(receive_buffer_bytes) / (1 << 20),
                             static_cast<double>(kWantedReceiveBytes) / (1 << 20), 1e3 * tolerated_s),
                 "as root: sysctl -w net.core.rmem_max=4194304"};
}

std::vector<Finding> audit(const Configuration& box, const Intention& intention) {
  std::vector<Finding> findings;
  for (const Check check : kChecks) {
    if (auto finding = check(box, intention)) findings.push_back(std::move(*finding));
  }
  put_worst_first(findings);
  return findings;
}

}  // namespace kphi::netbox
