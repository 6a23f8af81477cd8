#include "fit/flights/flight_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "base/error.hpp"
#include "base/text.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 30;

/// The channel of a source; lists grow to hold it.
FlightChannel& channel_of(FlightLog& log, const FlightSource& source) {
  const auto in_list = [&](std::vector<FlightChannel>& list) -> FlightChannel& {
    if (list.size() <= source.index) list.resize(source.index + 1);
    return list[source.index];
  };
  switch (source.quantity) {
    case FlightQuantity::specific_force:
      return log.specific_force.at(source.index);
    case FlightQuantity::angular_rate:
      return log.angular_rate.at(source.index);
    case FlightQuantity::angular_acceleration:
      return log.angular_acceleration.at(source.index);
    case FlightQuantity::rotor_speed:
      return in_list(log.rotor_speed);
    case FlightQuantity::command:
      return in_list(log.command);
    case FlightQuantity::arm_angle:
      return in_list(log.arm_angle);
    case FlightQuantity::voltage:
      return log.voltage;
    case FlightQuantity::density:
      return log.density;
    case FlightQuantity::height:
      return log.height;
    case FlightQuantity::climb:
    case FlightQuantity::time:
      break;
  }
  return log.climb;
}

/// Formats have room for more motors than a vehicle has: those at the end that never did anything are not there.
void drop_idle_end(std::vector<FlightChannel>& rotors) {
  const auto is_idle = [](const FlightChannel& rotor) {
    return std::ranges::all_of(rotor.values, [](double value) { return value == 0; });
  };
  while (!rotors.empty() && is_idle(rotors.back())) rotors.pop_back();
}

/// A sensor that two topics hold: the preferred one, unless it was logged at a small part of the other's rate.
constexpr std::size_t kMuchDenser = 3;

bool is_over_start(const FlightSource& source) {
  return source.series == "vehicle_local_position.z" || source.series == "stateEstimate.z";
}

}  // namespace

SeriesSet::SeriesSet(std::string path, const std::vector<FlightSource>& of_format, const FlightLayout& told)
    : path_(std::move(path)) {
  for (const FlightSource& source : of_format)
    if (!told.has(source.quantity)) series_.push_back({source});
  for (const FlightSource& source : told.sources)
    if (source.quantity != FlightQuantity::time) series_.push_back({source, true});
}

void SeriesSet::add(std::size_t index, double time_s, double value) {
  FlightSeries& series = series_[index];
  const FlightSource& source = series.source;
  if (source.quantity == FlightQuantity::command && std::isnan(value)) value = -source.offset / source.factor;
  value = value * source.factor + source.offset;
  if (!std::isfinite(value)) {
    ++series.not_finite;
    return;
  }
  if (source.quantity == FlightQuantity::rotor_speed) value = std::abs(value);
  if (source.quantity == FlightQuantity::command) {
    series.reversed += value < -0.02 ? 1 : 0;
    value = std::clamp(value, 0.0, 1.0);
  }
  FlightChannel& channel = series.channel;
  if (!channel.time_s.empty() && !(time_s > channel.time_s.back())) {
    series.backward += time_s < channel.time_s.back() ? 1 : 0;
    return;
  }
  if (++values_ > kMostFlightValues)
    throw ConfigurationError(
        fmt::format("{}: more than {} million values; cut the log", path_, kMostFlightValues / 1'000'000));
  channel.time_s.push_back(time_s);
  channel.values.push_back(value);
}

void SeriesSet::move_to(FlightLog& log) {
  const auto warn = [&](const FlightSeries& series, std::size_t count, const char* what, const char* next_move) {
    if (count > 0)
      log.findings.push_back({Severity::warning,
                              fmt::format("{}: {} of {} values {}", printable(series.source.series), count,
                                          count + series.channel.values.size(), what),
                              next_move});
  };
  for (FlightSeries& series : series_) {
    FlightChannel& channel = channel_of(log, series.source);
    const bool is_denser = series.channel.values.size() >= kMuchDenser * channel.values.size();
    if (!channel.values.empty() && !(is_sensor(series.source.quantity) && is_denser)) continue;
    warn(series, series.not_finite, "are no numbers and left out", "");
    warn(series, series.backward, "have a time before the one before them and are left out", "check the log's clock");
    warn(series, series.reversed, "ask for thrust the other way and count as 0", "");
    if (series.channel.values.empty()) {
      if (series.is_told)
        log.findings.push_back(
            {Severity::warning,
             fmt::format("{} of the layout is not in the log, or has no value", in_quotes(series.source.series)),
             "check its name, and whether it was logged"});
      continue;
    }
    if (is_over_start(series.source))
      log.findings.push_back({Severity::note, "height is over the start, not over the ground", ""});
    channel = std::move(series.channel);
  }
  drop_idle_end(log.rotor_speed);
  drop_idle_end(log.command);
  while (!log.arm_angle.empty() && log.arm_angle.back().values.empty()) log.arm_angle.pop_back();
}

std::vector<FlightSource> axes(FlightQuantity quantity, const std::vector<std::string>& series, double factor,
                               double sign_yz) {
  std::vector<FlightSource> sources;
  for (std::size_t axis = 0; axis < series.size(); ++axis)
    sources.push_back({quantity, axis, series[axis], axis == 0 ? factor : sign_yz * factor});
  return sources;
}

FlightLog parse_flight(std::string_view bytes, const std::string& path, const FlightLayout& layout) {
  FlightLog log;
  if (bytes.starts_with(kUlogMagic))
    read_ulog(bytes, path, layout, log);
  else if (bytes.starts_with(kCardLogMagic))
    read_card_log(bytes, path, layout, log);
  else
    read_flight_table(bytes, path, layout, log);
  for (Finding& finding : audit_channels(log)) log.findings.push_back(std::move(finding));
  put_worst_first(log.findings);
  return log;
}

FlightLog read_flight(const std::filesystem::path& path, const FlightLayout& layout) {
  std::string bytes;
  try {
    bytes = TextFile(path, kMostBytes).rest();
  } catch (const std::runtime_error& error) {
    throw ConfigurationError(fmt::format("{} {}", path.string(), error.what()));
  }
  return parse_flight(bytes, path.string(), layout);
}

}  // namespace kphi::fit
