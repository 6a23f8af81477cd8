#include "fit/logs/rcbenchmark_csv.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "fit/logs/column_unit.hpp"

namespace kphi::fit {
namespace {

[[noreturn]] void refuse(const Table& table, const std::string& what) {
  throw ConfigurationError(fmt::format("{}:{}: {}", table.path, std::max<std::size_t>(table.header_line, 1), what));
}

/// A column of the table in the units inside.
struct Channel {
  std::size_t column = 0;
  std::string unit;
  double factor = 1;
  [[nodiscard]] std::optional<double> of(const TableRow& row) const {
    const auto value = parse_number(row.fields[column]);
    return value ? std::optional(*value * factor) : std::nullopt;
  }
};

/// The channel by the name in front of the unit; nothing when it is not there, or, with `unread`, when its unit is not
/// known, which is noted there. The same name twice is refused.
std::optional<Channel> channel(const Table& table, std::string_view name, Measure measure,
                               std::vector<std::string>* unread = nullptr) {
  std::optional<Channel> found;
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    const HeaderName header = split_header(table.header[i]);
    if (header.name != name) continue;
    const auto factor = unit_factor(measure, header.unit);
    if (!factor) {
      const auto what = fmt::format("unit of column '{}' is none of {}", table.header[i], unit_list(measure));
      if (unread == nullptr) refuse(table, what);
      unread->push_back(what);
      continue;
    }
    if (found) {
      const bool same = table.header[found->column] == table.header[i];
      refuse(table, same ? fmt::format("more than one column '{}'", table.header[i])
                         : fmt::format("two {} columns with different units", name));
    }
    found = Channel{i, header.unit, *factor};
  }
  return found;
}

std::optional<double> value(const std::optional<Channel>& channel, const TableRow& row) {
  return channel ? channel->of(row) : std::nullopt;
}

struct Channels {
  std::vector<std::string> unread;  // filled by those below
  explicit Channels(const Table& table)
      : thrust(channel(table, "Thrust", Measure::thrust)),
        electrical(channel(table, "Motor Electrical Speed", Measure::speed)),
        optical(channel(table, "Motor Optical Speed", Measure::speed)),
        time(channel(table, "Time", Measure::time, &unread)),
        throttle(channel(table, "ESC signal", Measure::throttle, &unread)),
        torque(channel(table, "Torque", Measure::torque, &unread)),
        voltage(channel(table, "Voltage", Measure::voltage, &unread)),
        current(channel(table, "Current", Measure::current, &unread)) {
    if (!throttle) throttle = channel(table, "ESC", Measure::throttle, &unread);
    if (const auto column = table.find_column("TargetRPM")) target = Channel{*column, "RPM", 1};
    if (!thrust)
      refuse(table, "no column 'Thrust (unit)': no RCbenchmark table; --column tells the columns of another");
    if (!electrical && !optical)
      refuse(table, "neither 'Motor Electrical Speed (RPM)' nor 'Motor Optical Speed (RPM)'");
  }
  std::optional<Channel> thrust, electrical, optical, time, throttle, torque, voltage, current, target;
};

}  // namespace

StandLog read_rcbenchmark(std::string_view text, std::string path) {
  const Table table = read_csv(text, std::move(path));
  const Channels channels(table);
  StandLog log;
  log.path = table.path;
  log.thrust_unit = channels.thrust->unit;
  log.has_electrical = channels.electrical.has_value();
  log.has_optical = channels.optical.has_value();
  log.problems = table.problems;
  log.unread = channels.unread;
  for (const TableRow& row : table.rows) {
    const auto thrust = channels.thrust->of(row);
    if (!thrust) {
      log.problems.push_back({row.line, "thrust is no number; the line is left out"});
      continue;
    }
    StandRow stand{.line = row.line, .thrust_n = *thrust};
    stand.time_s = value(channels.time, row);
    stand.throttle_us = value(channels.throttle, row);
    stand.electrical_rpm = value(channels.electrical, row);
    stand.optical_rpm = value(channels.optical, row);
    stand.torque_nm = value(channels.torque, row);
    stand.voltage_v = value(channels.voltage, row);
    stand.current_a = value(channels.current, row);
    stand.target_rpm = value(channels.target, row);
    log.rows.push_back(stand);
  }
  return log;
}

}  // namespace kphi::fit
