#include "fit/logs/stand_log.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.hpp"
#include "base/ordered_work.hpp"
#include "base/text.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

struct UnitRow {
  Measure measure;
  double factor;
  std::array<const char*, 5> names{};  ///< messages list the first
};

constexpr double kPoundForce = 4.4482216152605;  // N, exactly (0.45359237 kg × 9.80665 m/s²)
constexpr double kInch = 0.0254;                 // m, exactly
constexpr std::size_t kMostRows = 10'000'000;    // 2 GB of memory
constexpr double kGramForce = from_gram_force(1).value();

constexpr std::array kUnits{
    UnitRow{Measure::time, 1, {"s"}},
    UnitRow{Measure::time, 1e-3, {"ms"}},
    UnitRow{Measure::time, 1e-6, {"µs", "us"}},
    UnitRow{Measure::time, 60, {"min"}},
    UnitRow{Measure::throttle, 1, {"µs", "us"}},
    UnitRow{Measure::throttle, 1e3, {"ms"}},
    UnitRow{Measure::speed, 1, {"RPM", "rpm", "1/min"}},
    UnitRow{Measure::speed, 1 / kRadPerSecPerRpm, {"rad/s", "rad_s"}},
    UnitRow{Measure::speed, 60, {"Hz", "hz", "1/s", "rev/s"}},
    UnitRow{Measure::speed, 1000, {"krpm"}},
    UnitRow{Measure::thrust, 1, {"N", "n"}},
    UnitRow{Measure::thrust, 1e-3, {"mN"}},
    UnitRow{Measure::thrust, 1e3, {"kN"}},
    UnitRow{Measure::thrust, kGramForce, {"gf", "g"}},
    UnitRow{Measure::thrust, 1000 * kGramForce, {"kgf", "kg"}},
    UnitRow{Measure::thrust, kPoundForce, {"lbf", "lb"}},
    UnitRow{Measure::thrust, kPoundForce / 16, {"ozf", "oz"}},
    UnitRow{Measure::torque, 1, {"N·m", "Nm", "nm", "N m"}},
    UnitRow{Measure::torque, 1e-3, {"mN·m", "mNm"}},
    UnitRow{Measure::torque, 1e-3, {"N·mm", "Nmm"}},
    UnitRow{Measure::torque, kPoundForce / 16 * kInch, {"ozf·in", "ozf-in"}},
    UnitRow{Measure::torque, kPoundForce* kInch, {"lbf·in"}},
    UnitRow{Measure::torque, kPoundForce * 12 * kInch, {"lbf·ft"}},
    UnitRow{Measure::torque, kGramForce * 1e-2, {"gf·cm"}},
    UnitRow{Measure::voltage, 1, {"V", "v"}},
    UnitRow{Measure::voltage, 1e-3, {"mV"}},
    UnitRow{Measure::current, 1, {"A", "a"}},
    UnitRow{Measure::current, 1e-3, {"mA"}},
    UnitRow{Measure::angle, 1, {"deg", "°"}},
    UnitRow{Measure::angle, 180 / kPi, {"rad"}},
};

/// The units of the measure, for messages: "N, mN, kN, gf, …".
std::string unit_list(Measure measure) {
  std::string list;
  for (const UnitRow& row : kUnits)
    if (row.measure == measure) list += (list.empty() ? "" : ", ") + std::string(row.names.front());
  return list;
}

struct RoleRow {
  Role role;
  const char* name;
  Measure measure;
};

constexpr std::array<RoleRow, 11> kRoles{{
    {&StandRow::time_s, "time", Measure::time},
    {&StandRow::throttle_us, "throttle", Measure::throttle},
    {&StandRow::optical_rpm, "speed", Measure::speed},
    {&StandRow::electrical_rpm, "electrical_speed", Measure::speed},
    {kThrust, "thrust", Measure::thrust},
    {&StandRow::torque_nm, "torque", Measure::torque},
    {&StandRow::voltage_v, "voltage", Measure::voltage},
    {&StandRow::current_a, "current", Measure::current},
    {&StandRow::occlusion_deg, "occlusion", Measure::angle},
    {&StandRow::repetition, "repetition", Measure::count},
    {&StandRow::target_rpm, "target_speed", Measure::speed},
}};

const RoleRow& row_of(Role role) { return *std::ranges::find(kRoles, role, &RoleRow::role); }

/// The channels of an RCbenchmark table by the name before the unit; of two names for one role the first counts.
struct KnownChannel {
  const char* name;
  Role role;
  const char* unit = "";  ///< empty: the header gives it
  bool required = false;  ///< an unknown unit refuses the file
};

constexpr KnownChannel kRcbenchmark[] = {{"Thrust", kThrust, "", true},
                                         {"Motor Electrical Speed", &StandRow::electrical_rpm, "", true},
                                         {"Motor Optical Speed", &StandRow::optical_rpm, "", true},
                                         {"Time", &StandRow::time_s},
                                         {"ESC signal", &StandRow::throttle_us},
                                         {"ESC", &StandRow::throttle_us},
                                         {"Torque", &StandRow::torque_nm},
                                         {"Voltage", &StandRow::voltage_v},
                                         {"Current", &StandRow::current_a},
                                         {"TargetRPM", &StandRow::target_rpm, "RPM"}};

/// A column with its role and the factor to the unit inside.
struct Column {
  Role role{};
  std::size_t index = 0;
  double factor = 1;
  std::string unit;
};
using Columns = std::vector<Column>;

[[noreturn]] void refuse(const Table& table, const std::string& what) {
  throw ConfigurationError(fmt::format("{}:{}: {}", table.path, std::max<std::size_t>(table.header_line, 1), what));
}

/// The first of these names, for a message.
std::string list_of(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 40;
  std::string list;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) list += (i == 0 ? "" : ", ") + in_quotes(names[i]);
  return names.size() <= kShown ? list : list + fmt::format(" and {} more", names.size() - kShown);
}

const Column* find(const Columns& columns, Role role) {
  const auto found = std::ranges::find(columns, role, &Column::role);
  return found == columns.end() ? nullptr : &*found;
}

std::size_t column_named(const Table& table, const std::string& name) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < table.header.size(); ++i)
    if (table.header[i] == name) found.push_back(i);
  for (std::size_t i = 0; found.empty() && i < table.header.size(); ++i)
    if (split_header(table.header[i]).name == name) found.push_back(i);
  if (found.size() == 1) return found.front();
  refuse(table, fmt::format("{} column {}; the file has {}", found.empty() ? "no" : "more than one", in_quotes(name),
                            list_of(table.header)));
}

Column map_column(const Table& table, const ColumnRole& wanted) {
  const RoleRow& role = row_of(wanted.role);
  Column column{wanted.role, column_named(table, wanted.header), 1, wanted.unit};
  const std::string& header = table.header[column.index];
  std::string by_header = split_header(header).unit;
  if (by_header.empty()) by_header = unit_suffix(header, role.measure);
  if (column.unit.empty()) column.unit = by_header;
  const auto factor = unit_factor(role.measure, column.unit);
  const std::string known = unit_list(role.measure);
  if (!factor && column.unit.empty()) {
    refuse(table, fmt::format("no unit given for column {}; name it: --column {}={}:UNIT with UNIT one of {}",
                              in_quotes(header), role.name, wanted.header, known));
  }
  if (!factor)
    refuse(table,
           fmt::format("unknown unit {} of column {}; known are {}", in_quotes(column.unit), in_quotes(header), known));
  const auto header_factor = unit_factor(role.measure, by_header);
  if (header_factor && *header_factor != *factor) {
    refuse(table, fmt::format("unit mismatch: column {} is in {} by its header and in {} by --column; correct one",
                              in_quotes(header), by_header, column.unit));
  }
  column.factor = *factor;
  return column;
}

void map_channel(const Table& table, const KnownChannel& channel, Columns& columns, std::vector<std::string>& unread) {
  const Measure measure = row_of(channel.role).measure;
  if (find(columns, channel.role) != nullptr) return;
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    const HeaderName header = split_header(table.header[i]);
    if (header.name != channel.name) continue;
    const std::string unit = header.unit.empty() ? channel.unit : header.unit;
    const auto factor = unit_factor(measure, unit);
    if (!factor) {
      const auto what = fmt::format("unknown unit {} of column {}; known are {}", in_quotes(unit),
                                    in_quotes(table.header[i]), unit_list(measure));
      if (channel.required) refuse(table, what);
      unread.push_back(what);
    } else if (const Column* twice = find(columns, channel.role)) {
      refuse(table, table.header[twice->index] == table.header[i]
                        ? fmt::format("more than one column {}", in_quotes(table.header[i]))
                        : fmt::format("two {} columns with different units", channel.name));
    } else {
      columns.push_back({channel.role, i, *factor, unit});
    }
  }
}

/// Why the value is impossible in its role; empty if it is possible.
std::string objection(Role role, double value) {
  if (role == &StandRow::occlusion_deg && !(value >= 0 && value < 360)) return "occlusion outside 0 to 360°";
  if (role == &StandRow::repetition && !(value >= 1 && value <= 1000 && value == std::floor(value)))
    return "repetition is not a whole number from 1 to 1000";
  return {};
}

/// "12,5" → "12.5"
std::string with_point(std::string field) {
  std::replace(field.begin(), field.end(), ',', '.');
  return field;
}

/// Why a field is not a number.
std::string not_a_number(const Column& column, const std::string& field) {
  const char* role = row_of(column.role).name;
  return field.empty() ? fmt::format("{} is missing", role) : fmt::format("{} \"{}\" is not a number", role, field);
}

/// The field as a number; nullopt if it is not one. Throws ConfigurationError where a decimal comma would make it one.
std::optional<double> number_in(const TableRow& fields, std::size_t column, bool decimal_comma,
                                const std::string& path) {
  const std::string& field = fields.fields[column];
  if (decimal_comma) return parse_number(with_point(field));
  const auto value = parse_number(field);
  if (value || field.find(',') == std::string::npos || !parse_number(with_point(field))) return value;
  throw ConfigurationError(
      fmt::format("{}:{}: \"{}\" has a decimal comma; import with --decimal-comma", path, fields.line, field));
}

/// What one block of a log gives.
struct LogBlock {
  std::size_t bytes = 0;
  std::vector<StandRow> rows;
  std::vector<TableProblem> problems, not_numbers;
};

/// How the rows of a table are read.
struct RowFormat {
  Columns columns;
  char separator = ',';
  bool decimal_comma = false;
};

/// nullopt, and the reason in the block, if the thrust is not a number or a value is impossible.
std::optional<StandRow> read_row(const TableRow& fields, const RowFormat& format, const std::string& path,
                                 LogBlock& block) {
  StandRow row{.line = fields.line};
  for (const Column& column : format.columns) {
    const auto value = number_in(fields, column.index, format.decimal_comma, path);
    const std::string& field = fields.fields[column.index];
    if (!value && column.role != kThrust && column.role != &StandRow::occlusion_deg) {
      if (!field.empty()) block.not_numbers.push_back({fields.line, not_a_number(column, field)});
      continue;
    }
    const std::string why = value ? objection(column.role, *value * column.factor) : not_a_number(column, field);
    if (!why.empty()) {
      block.problems.push_back({fields.line, why + "; line skipped"});
      return std::nullopt;
    }
    if (column.role == kThrust)
      row.thrust_n = *value * column.factor;
    else
      row.*column.role = *value * column.factor;
  }
  return row;
}

void append(StandLog& log, LogBlock block) {
  const auto move_to = [](auto& to, auto& from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  move_to(log.rows, block.rows);
  move_to(log.problems, block.problems);
  move_to(log.not_numbers, block.not_numbers);
}

LogBlock read_block(const Table& begin, std::string_view text, std::size_t line, const RowFormat& format) {
  LogBlock block;
  block.bytes = text.size();
  Table table = read_csv_rows(begin, text, line, format.separator, [&](const Table&, const TableRow& fields) {
    if (const auto row = read_row(fields, format, begin.path, block)) block.rows.push_back(*row);
  });
  block.problems.insert(block.problems.begin(), table.problems.begin(), table.problems.end());
  std::ranges::stable_sort(block.problems, {}, &TableProblem::line);
  return block;
}

/// The lines up to the header, the first that is not blank.
std::string_view head_of(std::string_view text) {
  std::size_t end = 0;
  for (bool blank = true; blank && end < text.size();) {
    const std::size_t begin = end;
    end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    blank = text.substr(begin, end - begin).find_first_not_of(" \t\r\n\xEF\xBB\xBF") == std::string_view::npos;
  }
  return text.substr(0, end);
}

std::size_t line_ends(std::string_view text) {
  std::size_t n = 0;
  for (std::size_t at = text.find('\n'); at != std::string_view::npos; at = text.find('\n', at + 1)) ++n;
  return n;
}

/// `map` finds the columns when the header is known. A thread per processor reads blocks.
template <class MapColumns>
StandLog read_rows(TextBlocks text, std::string path, const CsvDialect& dialect, const MapColumns& map) {
  const std::string_view head = head_of(text.front());
  RowFormat format{{}, dialect.separator, dialect.decimal_comma};
  if (format.separator == 0) format.separator = likely_separator(head);
  const Table begin = read_csv(head, std::move(path), format.separator);
  format.columns = map(begin);
  StandLog log{.path = begin.path,
               .thrust_unit = find(format.columns, kThrust)->unit,
               .has_electrical = find(format.columns, &StandRow::electrical_rpm) != nullptr,
               .has_optical = find(format.columns, &StandRow::optical_rpm) != nullptr};
  OrderedWork<LogBlock> blocks([&](LogBlock block) {
    if (log.rows.empty() && block.bytes > 0)
      log.rows.reserve(std::min(kMostRows, block.rows.size() * (text.bytes() / block.bytes + 1)));
    if (log.rows.size() + block.rows.size() > kMostRows) {
      throw ConfigurationError(
          fmt::format("{}: more than {} million rows; import it in parts", log.path, kMostRows / 1'000'000));
    }
    append(log, std::move(block));
  });
  std::size_t line = 1 + line_ends(head);
  std::string_view block = text.front().substr(head.size());
  for (; !text.front().empty(); text.pop(), block = text.front()) {
    blocks.add(launch_for(block.size()),
               [&begin, &format, line, text = std::string(block)] { return read_block(begin, text, line, format); });
    line += line_ends(block);
  }
  blocks.finish();
  return log;
}

bool has_speed(const Columns& columns) {
  return find(columns, &StandRow::optical_rpm) != nullptr || find(columns, &StandRow::electrical_rpm) != nullptr;
}

}  // namespace

HeaderName split_header(std::string_view header) {
  for (const auto& [open, close] : {std::pair('(', ')'), std::pair('[', ']')}) {
    if (header.empty() || header.back() != close) continue;
    const std::size_t begin = header.rfind(open);
    if (begin == std::string_view::npos) continue;
    std::string_view name = header.substr(0, begin);
    while (!name.empty() && name.back() == ' ') name.remove_suffix(1);
    return {std::string(name), std::string(header.substr(begin + 1, header.size() - begin - 2))};
  }
  return {std::string(header), ""};
}

std::string unit_suffix(std::string_view name, Measure measure) {
  for (std::size_t bar = name.find('_'); bar != std::string_view::npos; bar = name.find('_', bar + 1)) {
    const std::string_view end = name.substr(bar + 1);
    if (unit_factor(measure, end)) return std::string(end);
  }
  return {};
}

std::optional<double> unit_factor(Measure measure, std::string_view unit) {
  if (measure == Measure::count) return 1.0;
  for (const UnitRow& row : kUnits)
    for (const char* name : row.names)
      if (row.measure == measure && name != nullptr && unit == name) return row.factor;
  return std::nullopt;
}

bool motor_off(const StandRow& row, SpeedSource source) {
  return row.throttle_us && *row.throttle_us <= kIdleUs && rpm_of(row, source).value_or(0) == 0;
}

double largest_thrust(const StandLog& log) {
  double largest = 0;
  for (const StandRow& row : log.rows) largest = std::max(largest, std::abs(row.thrust_n));
  return largest;
}

ColumnRole parse_column_role(std::string_view text) {
  const std::size_t equals = text.find('=');
  std::vector<const char*> names;
  for (const RoleRow& row : kRoles) {
    names.push_back(row.name);
    if (text.substr(0, equals) != row.name || equals == std::string_view::npos || equals + 1 == text.size()) continue;
    ColumnRole column{row.role, std::string(text.substr(equals + 1)), ""};
    const std::size_t colon = column.header.rfind(':');
    if (colon != std::string::npos && unit_factor(row.measure, column.header.substr(colon + 1)) &&
        row.measure != Measure::count) {
      column.unit = column.header.substr(colon + 1);
      column.header.resize(colon);
    }
    return column;
  }
  throw ConfigurationError(fmt::format("--column {}: expected ROLE=HEADER or ROLE=HEADER:UNIT with ROLE one of {}",
                                       text, fmt::join(names, ", ")));
}

StandLog read_columns(TextBlocks text, std::string path, const std::vector<ColumnRole>& columns,
                      const CsvDialect& dialect) {
  return read_rows(std::move(text), std::move(path), dialect, [&](const Table& table) {
    Columns mapped;
    for (const ColumnRole& column : columns) {
      if (find(mapped, column.role) != nullptr)
        refuse(table, fmt::format("--column names {} twice", row_of(column.role).name));
      mapped.push_back(map_column(table, column));
    }
    if (find(mapped, kThrust) == nullptr || !has_speed(mapped))
      refuse(table, "a thrust and a speed are needed: --column thrust=HEADER --column speed=HEADER");
    return mapped;
  });
}

StandLog read_rcbenchmark(TextBlocks text, std::string path, const CsvDialect& dialect) {
  std::vector<std::string> unread;
  StandLog log = read_rows(std::move(text), std::move(path), dialect, [&](const Table& table) {
    Columns columns;
    for (const KnownChannel& channel : kRcbenchmark) map_channel(table, channel, columns, unread);
    if (find(columns, kThrust) == nullptr) {
      refuse(table,
             "no column \"Thrust (unit)\", so this is not an RCbenchmark table; name the columns of another table "
             "with --column");
    }
    if (!has_speed(columns))
      refuse(table, "no column \"Motor Electrical Speed (RPM)\" or \"Motor Optical Speed (RPM)\"");
    return columns;
  });
  log.unread = std::move(unread);
  return log;
}

}  // namespace kphi::fit
