#include "fit/logs/row_groups.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/statistics.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

constexpr double kThrustSeen = 0.05;  // of the largest
constexpr std::size_t kFewestRows = 3;

/// A log with the same channels and without rows.
StandLog like(const StandLog& log) {
  StandLog other{.path = log.path,
                 .thrust_unit = log.thrust_unit,
                 .has_electrical = log.has_electrical,
                 .has_optical = log.has_optical};
  other.layout = log.layout;
  other.groups = log.groups;
  other.turned = log.turned;
  return other;
}

/// By what is the key of a row; in the order of their first rows.
template <class KeyOf>
std::vector<RowGroup> by(RowGroup group, KeyOf key_of) {
  std::vector<RowGroup> parts;
  std::map<std::string, std::size_t> places;
  for (const StandRow& row : group.log.rows) {
    const std::string key = key_of(row);
    const auto [at, fresh] = places.emplace(key, parts.size());
    if (fresh) {
      const std::string name = group.name.empty() || key.empty() ? group.name + key : group.name + ", " + key;
      parts.push_back({name, like(group.log), group.turned});
    }
    parts[at->second].log.rows.push_back(row);
  }
  if (parts.empty()) return parts;
  // What was left out belongs to the table; it is told once.
  parts.front().log.problems = std::move(group.log.problems);
  parts.front().log.not_numbers = std::move(group.log.not_numbers);
  parts.front().log.unread = std::move(group.log.unread);
  return parts;
}

/// Of T over ω², among rows; 0 with few.
double slope_sign(const std::vector<std::pair<double, double>>& points) {
  if (points.size() < kFewestRows) return 0;
  double x = 0, t = 0, sxx = 0, stt = 0, sxt = 0;
  for (const auto& [one, thrust] : points) x += one, t += thrust;
  x /= static_cast<double>(points.size()), t /= static_cast<double>(points.size());
  for (const auto& [one, thrust] : points)
    sxx += square(one - x), stt += square(thrust - t), sxt += (one - x) * (thrust - t);
  return sxx > 0 && stt > 0 ? sxt / std::sqrt(sxx * stt) : 0;
}

/// Both signs of thrust, and each grows with speed.
bool has_two_directions(const StandLog& log, SpeedSource source) {
  constexpr double kFollows = 0.7;
  const double seen = kThrustSeen * largest_thrust(log);
  std::vector<std::pair<double, double>> up, down;
  double most_up = 0, most_down = 0;
  const std::size_t every = log.rows.size() / 20'000 + 1;
  for (std::size_t i = 0; i < log.rows.size(); i += every) {
    const StandRow& row = log.rows[i];
    const double rpm = std::abs(rpm_of(row, source).value_or(0));
    if (rpm == 0 || std::abs(row.thrust_n) < seen) continue;
    (row.thrust_n > 0 ? up : down).emplace_back(rpm * rpm, row.thrust_n);
    (row.thrust_n > 0 ? most_up : most_down) = std::max(row.thrust_n > 0 ? most_up : most_down, std::abs(row.thrust_n));
  }
  return std::min(most_up, most_down) > 2 * seen && slope_sign(up) > kFollows && slope_sign(down) < -kFollows;
}

bool has_two_spins(const StandLog& log, SpeedSource source) {
  std::size_t forward = 0, backward = 0;
  for (const StandRow& row : log.rows) {
    const double rpm = rpm_of(row, source).value_or(0);
    forward += rpm > 100 ? 1 : 0, backward += rpm < -100 ? 1 : 0;
  }
  return forward >= kFewestRows && backward >= kFewestRows;
}

void turn(RowGroup& group, bool thrust) {
  if (thrust) turn_thrust(group.log);
  for (StandRow& row : group.log.rows) {
    if (row.optical_rpm && *row.optical_rpm < 0) row.optical_rpm = -*row.optical_rpm;
    if (row.electrical_rpm && *row.electrical_rpm < 0) row.electrical_rpm = -*row.electrical_rpm;
  }
  group.turned = true;
}

std::vector<RowGroup> by_direction(RowGroup group, SpeedSource source) {
  constexpr const char *kForward = "forward", *kReverse = "reverse";
  const bool spins = has_two_spins(group.log, source);
  if (!spins && !has_two_directions(group.log, source)) {
    std::vector<RowGroup> one;
    one.push_back(std::move(group));
    return one;
  }
  const double seen = kThrustSeen * largest_thrust(group.log);
  // By the throttle where it tells: rows of little thrust belong to one side, too.
  double lowest_up = INFINITY, highest_down = -INFINITY;
  for (const StandRow& row : group.log.rows) {
    if (!row.throttle_us || std::abs(row.thrust_n) < seen) continue;
    if (row.thrust_n > 0)
      lowest_up = std::min(lowest_up, *row.throttle_us);
    else
      highest_down = std::max(highest_down, *row.throttle_us);
  }
  const bool by_throttle =
      !spins && std::isfinite(lowest_up) && std::isfinite(highest_down) && highest_down < lowest_up;
  const double middle = (lowest_up + highest_down) / 2;
  std::vector<RowGroup> parts = by(std::move(group), [&](const StandRow& row) {
    const double side = spins                            ? rpm_of(row, source).value_or(0)
                        : by_throttle && row.throttle_us ? *row.throttle_us - middle
                                                         : row.thrust_n;
    return side < 0 ? kReverse : kForward;
  });
  for (RowGroup& part : parts) {
    if (!part.name.ends_with(kReverse)) continue;
    double sum = 0;
    for (const StandRow& row : part.log.rows) sum += row.thrust_n;
    turn(part, sum < 0);
  }
  return parts;
}

/// "11.1 V" where a log has a few exact voltages, each in several rows: what the supply was set to.
std::vector<RowGroup> by_voltage(RowGroup group) {
  constexpr std::size_t kMost = 8;
  std::map<double, std::size_t> counts;
  for (const StandRow& row : group.log.rows) {
    if (!row.voltage_v)
      counts[INFINITY] = 0;
    else
      ++counts[*row.voltage_v];
    if (counts.size() > kMost) break;
  }
  const bool nominal = counts.size() > 1 && counts.size() <= kMost &&
                       std::ranges::all_of(counts, [](const auto& one) { return one.second >= kFewestRows; }) &&
                       counts.rbegin()->first > 1.05 * counts.begin()->first;
  if (!nominal) {
    std::vector<RowGroup> one;
    one.push_back(std::move(group));
    return one;
  }
  return by(std::move(group), [](const StandRow& row) { return fmt::format("{:g} V", *row.voltage_v); });
}

template <class Split>
std::vector<RowGroup> each(std::vector<RowGroup> groups, Split split) {
  std::vector<RowGroup> all;
  for (RowGroup& group : groups)
    for (RowGroup& part : split(std::move(group))) all.push_back(std::move(part));
  return all;
}

}  // namespace

RowGroups split_groups(StandLog log, const RowSelection& selection) {
  const SpeedSource source = choose_speed(log, selection);
  RowGroups result;
  result.groups.push_back({"", std::move(log), false});
  const std::size_t rows = result.groups.front().log.rows.size();
  const auto names = result.groups.front().log.groups;
  if (names.size() > 1)
    result.groups = by(std::move(result.groups.front()), [&](const StandRow& row) { return names[row.group]; });
  result.groups =
      each(std::move(result.groups), [&](RowGroup group) { return by_direction(std::move(group), source); });
  result.groups = each(std::move(result.groups), [](RowGroup group) { return by_voltage(std::move(group)); });
  std::erase_if(result.groups, [&](const RowGroup& group) {
    return result.groups.size() > 1 && std::ranges::none_of(group.log.rows, [&](const StandRow& row) {
             return rpm_of(row, source).value_or(0) > 0;
           });
  });
  if (result.groups.size() < 2) return result;
  std::string list;
  for (const RowGroup& group : result.groups)
    list += (list.empty() ? "" : "; ") + group.name + (group.turned ? " (turned)" : "");
  result.findings.push_back({FindingKind::several_groups,
                             rows,
                             0,
                             fmt::format("rows of {} different things, fitted apart: {}", result.groups.size(), list),
                             {}});
  return result;
}

std::string TwoLevels::words() const {
  std::string text = "T/ω² lies on two levels at the same speeds:";
  for (const int i : {0, 1})
    text += fmt::format(" {:.3g} N/(rad/s)² in {} rows of lines {} to {}{}", k[i], rows[i], first_line[i], last_line[i],
                        i == 0 ? " and" : "");
  return text;
}

std::optional<TwoLevels> two_levels(const ImportedTable& table) {
  constexpr std::size_t kFewest = 8, kMost = 50'000;
  constexpr double kApart = 6;  // deviations within a level
  struct One {
    double k, speed;
    std::size_t line;
  };
  double largest = 0;
  for (std::size_t i = 0; i < table.size(); ++i) largest = std::max(largest, table.thrust_n(i));
  std::vector<One> rows;
  const std::size_t every = table.size() / kMost + 1;
  for (std::size_t i = 0; i < table.size(); i += every) {
    const double speed = table.speed_rad_s(i);
    if (table.thrust_n(i) > 0.2 * largest)
      rows.push_back({table.thrust_n(i) / (speed * speed), speed, table.rows[i].line});
  }
  if (rows.size() < kFewest) return std::nullopt;
  std::ranges::sort(rows, {}, &One::k);
  // The widest gap that leaves a tenth of the rows on either side.
  const std::size_t margin = std::max<std::size_t>(3, rows.size() / 10);
  std::size_t split = 0;
  double gap = 0;
  for (std::size_t i = margin; i + margin <= rows.size(); ++i)
    if (rows[i].k / rows[i - 1].k > 1 + gap) gap = rows[i].k / rows[i - 1].k - 1, split = i;
  if (split == 0) return std::nullopt;
  TwoLevels levels;
  double low[2], high[2], sd[2];
  for (const int side : {0, 1}) {
    const auto part = side == 0 ? std::span(rows).first(split) : std::span(rows).subspan(split);
    std::vector<double> k;
    low[side] = INFINITY, high[side] = 0, levels.first_line[side] = SIZE_MAX;
    for (const One& one : part) {
      k.push_back(one.k);
      low[side] = std::min(low[side], one.speed), high[side] = std::max(high[side], one.speed);
      levels.first_line[side] = std::min(levels.first_line[side], one.line);
      levels.last_line[side] = std::max(levels.last_line[side], one.line);
    }
    levels.k[side] = mean(k), sd[side] = std::sqrt(variance(k)), levels.rows[side] = k.size();
  }
  const double overlap = std::min(high[0], high[1]) - std::max(low[0], low[1]);
  const bool same_speeds = overlap > 0.5 * std::min(high[0] - low[0], high[1] - low[1]) && overlap > 0;
  const bool apart = levels.k[1] - levels.k[0] > kApart * std::max(sd[0], sd[1]) && levels.k[1] > 1.05 * levels.k[0];
  return same_speeds && apart ? std::optional(levels) : std::nullopt;
}

}  // namespace kphi::fit
