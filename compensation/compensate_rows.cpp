#include "compensation/compensate_rows.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <istream>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace kphi::compensation {
namespace {

constexpr std::size_t kFlushAt = 1 << 16;
constexpr std::size_t kColumns = 8;
constexpr std::array<std::string_view, kColumns> kColumnNames = {"theta1_deg", "theta2_deg", "theta3_deg", "theta4_deg",
                                                                 "thrust1_n",  "thrust2_n",  "thrust3_n",  "thrust4_n"};
constexpr std::string_view kCsvHeader =
    "phi1_deg,phi2_deg,phi3_deg,phi4_deg,k1,k2,k3,k4,speed1_rpm,speed2_rpm,speed3_rpm,speed4_rpm,flags\n";

struct FlagName {
  Flag flag;
  std::string_view name;
};
constexpr FlagName kFlagNames[] = {{Flag::thrust_nan, "thrust_nan"},
                                   {Flag::thrust_negative, "thrust_negative"},
                                   {Flag::speed_at_slowest, "speed_at_slowest"},
                                   {Flag::speed_at_fastest, "speed_at_fastest"},
                                   {Flag::arm_angle_unknown, "arm_angle_unknown"},
                                   {Flag::beyond_fit, "beyond_fit"},
                                   {Flag::at_floor, "at_floor"},
                                   {Flag::at_ceiling, "at_ceiling"}};

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  for (;;) {
    const std::size_t comma = line.find(',');
    fields.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return;
    line.remove_prefix(comma + 1);
  }
}

struct Columns {
  std::array<std::size_t, kColumns> place{};
  std::size_t count = 0;
};

constexpr const char* kNextMove =
    "; the first line must name theta1_deg..theta4_deg and thrust1_n..thrust4_n once each, separated by commas";

/// What is wrong with a column that stands there `found` times; `names` may hold it in another unit.
std::string complaint_about(std::string_view wanted, std::size_t found, const std::vector<std::string_view>& names) {
  const std::string column = "stdin:1: column `" + std::string(wanted) + "` ";
  if (found > 1) return column + "stands " + std::to_string(found) + " times" + kNextMove;
  const std::string_view stem = wanted.substr(0, wanted.find('_') + 1);
  for (const std::string_view name : names) {
    if (name.substr(0, stem.size()) != stem) continue;
    return column + "is missing, but there is `" + std::string(name) +
           "`; the unit is part of the name, degrees and N are read";
  }
  return column + "is missing" + kNextMove;
}

Columns read_header(std::string_view line) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (line.substr(0, kByteOrderMark.size()) == kByteOrderMark) line.remove_prefix(kByteOrderMark.size());
  if (trimmed(line).empty()) throw RowHeaderError(std::string("stdin:1: no header") + kNextMove);
  std::vector<std::string_view> names;
  split(line, names);
  Columns columns;
  columns.count = names.size();
  for (std::size_t wanted = 0; wanted < kColumns; ++wanted) {
    std::size_t found = 0;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i] != kColumnNames[wanted]) continue;
      columns.place[wanted] = i;
      ++found;
    }
    if (found != 1) throw RowHeaderError(complaint_about(kColumnNames[wanted], found, names));
  }
  return columns;
}

/// Empty when the row can be used, else why not.
std::string read_row(const std::vector<std::string_view>& fields, const Columns& columns,
                     std::array<double, kColumns>& values) {
  if (fields.size() != columns.count) {
    return "has " + std::to_string(fields.size()) + " fields where the header has " + std::to_string(columns.count);
  }
  for (std::size_t i = 0; i < kColumns; ++i) {
    const std::string_view text = fields[columns.place[i]];
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), values[i]);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(values[i])) {
      return std::string(kColumnNames[i]) + " is `" + std::string(text) + "`, not a finite number";
    }
  }
  return {};
}

void append(std::string& text, double value) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

struct RowStyle {
  const char* before[4];  ///< the four φ, the four k_i, the four speeds, the flags
  const char* quote;      ///< around a flag
  const char* between;    ///< two flags
  const char* end;
};
constexpr RowStyle kCsv{{"", ",", ",", ","}, "", " ", "\n"};
constexpr RowStyle kJson{{"{\"phi_deg\":[", "],\"k\":[", "],\"speed_rpm\":[", "],\"flags\":["}, "\"", ",", "]}\n"};

void append_row(std::string& text, const RowStyle& style, const Compensator& compensator, const SpeedCommand& command) {
  const auto four = [&](std::size_t group, const auto& value_of) {
    text += style.before[group];
    for (std::size_t i = 0; i < 4; ++i) {
      if (i != 0) text += ',';
      append(text, value_of(i));
    }
  };
  four(0, [&](std::size_t i) { return to_degrees(compensator.occlusion_angles()[i]); });
  four(1, [&](std::size_t i) { return compensator.scaling_factors()[i]; });
  four(2, [&](std::size_t i) { return to_rpm(command.speeds[i]); });
  text += style.before[3];
  const char* separator = "";
  for (std::size_t i = 0; i < 4; ++i) {
    if (!command.flags[i].any()) continue;
    for (const FlagName& entry : kFlagNames) {
      if (!command.flags[i].has(entry.flag)) continue;
      text += separator + (style.quote + std::to_string(i + 1)) + ":" + std::string(entry.name) + style.quote;
      separator = style.between;
    }
  }
  text += style.end;
}

void hand_on(std::string& buffer, std::ostream& out) {
  out.write(buffer.data(), static_cast<std::streamsize>(buffer.size()));
  out.flush();
  buffer.clear();
}

}  // namespace

RowCounts compensate_rows(std::istream& in, std::ostream& out, std::ostream& words, Compensator& compensator,
                          ArmRange reach, RowFormat format) {
  std::string line;
  std::getline(in, line);
  const Columns columns = read_header(line);

  RowCounts counts;
  std::string buffer(format == RowFormat::csv ? kCsvHeader : std::string_view());
  std::vector<std::string_view> fields;
  std::array<double, kColumns> values{};
  std::array<Radians, 4> arm_angles;
  std::array<Newtons, 4> thrusts;
  for (std::uint64_t line_number = 2; out && std::getline(in, line); ++line_number) {
    if (trimmed(line).empty()) continue;
    split(line, fields);
    const std::string complaint = read_row(fields, columns, values);
    if (!complaint.empty()) {
      ++counts.rejected;
      words << "stdin:" << line_number << ": " << complaint << "; row left out\n";
      continue;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      arm_angles[i] = from_degrees(values[i]);
      thrusts[i] = Newtons(values[i + 4]);
    }
    for (const Radians angle : arm_angles) {
      if (angle >= reach.from && angle <= reach.to) continue;
      ++counts.out_of_reach;
      break;
    }
    compensator.set_arms(arm_angles);
    const SpeedCommand command = compensator.speeds_for(thrusts);
    ++counts.written;
    append_row(buffer, format == RowFormat::csv ? kCsv : kJson, compensator, command);
    if (buffer.size() >= kFlushAt || in.rdbuf()->in_avail() <= 0) hand_on(buffer, out);
  }
  hand_on(buffer, out);
  return counts;
}

}  // namespace kphi::compensation
