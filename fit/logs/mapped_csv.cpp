#include "fit/logs/mapped_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.hpp"
#include "fit/logs/column_unit.hpp"

namespace kphi::fit {
namespace {

struct RoleRow {
  Role role;
  const char* name;
  Measure measure;
};

constexpr std::array<RoleRow, 10> kRoles{{
    {Role::time, "time", Measure::time},
    {Role::throttle, "throttle", Measure::throttle},
    {Role::speed, "speed", Measure::speed},
    {Role::electrical_speed, "electrical_speed", Measure::speed},
    {Role::thrust, "thrust", Measure::thrust},
    {Role::torque, "torque", Measure::torque},
    {Role::voltage, "voltage", Measure::voltage},
    {Role::current, "current", Measure::current},
    {Role::occlusion, "occlusion", Measure::angle},
    {Role::repetition, "repetition", Measure::count},
}};

const RoleRow& row_of(Role role) { return kRoles[static_cast<std::size_t>(role)]; }

[[noreturn]] void refuse(const Table& table, const std::string& what) {
  throw ConfigurationError(fmt::format("{}:{}: {}", table.path, std::max<std::size_t>(table.header_line, 1), what));
}

std::string role_list() {
  std::string list;
  for (const RoleRow& row : kRoles) list += (list.empty() ? "" : ", ") + std::string(row.name);
  return list;
}

/// A column with its role and the factor to the unit inside.
struct Mapped {
  Role role{};
  std::size_t column = 0;
  double factor = 1;
  std::string unit;
};

std::size_t column_named(const Table& table, const std::string& name) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < table.header.size(); ++i)
    if (table.header[i] == name) found.push_back(i);
  for (std::size_t i = 0; found.empty() && i < table.header.size(); ++i)
    if (split_header(table.header[i]).name == name) found.push_back(i);
  if (found.size() == 1) return found.front();
  std::string headers;
  for (const std::string& header : table.header) headers += (headers.empty() ? "" : ", ") + ("'" + header + "'");
  refuse(table, fmt::format("{} column '{}'; there are {}", found.empty() ? "no" : "more than one", name, headers));
}

Mapped map_column(const Table& table, const ColumnRole& wanted) {
  const RoleRow& role = row_of(wanted.role);
  Mapped mapped{wanted.role, column_named(table, wanted.header), 1, wanted.unit};
  const std::string& header = table.header[mapped.column];
  std::string told = split_header(header).unit;
  if (told.empty()) told = unit_suffix(header, role.measure);
  const auto by_header = unit_factor(role.measure, told);
  if (mapped.unit.empty()) mapped.unit = told;
  const auto factor = unit_factor(role.measure, mapped.unit);
  if (!factor) {
    refuse(table,
           mapped.unit.empty()
               ? fmt::format("column '{}' does not tell its unit; name it: --column {}={}:UNIT with UNIT of {}", header,
                             role.name, wanted.header, unit_list(role.measure))
               : fmt::format("unit '{}' of column '{}' is none of {}", mapped.unit, header, unit_list(role.measure)));
  }
  if (by_header && *by_header != *factor) {
    refuse(table, fmt::format("column '{}' is in {} by its header and in {} by --column; which is right?", header, told,
                              mapped.unit));
  }
  mapped.factor = *factor;
  return mapped;
}

void put(StandRow& row, Role role, double value) {
  switch (role) {
    case Role::time:
      row.time_s = value;
      break;
    case Role::throttle:
      row.throttle_us = value;
      break;
    case Role::speed:
      row.optical_rpm = value;
      break;
    case Role::electrical_speed:
      row.electrical_rpm = value;
      break;
    case Role::thrust:
      row.thrust_n = value;
      break;
    case Role::torque:
      row.torque_nm = value;
      break;
    case Role::voltage:
      row.voltage_v = value;
      break;
    case Role::current:
      row.current_a = value;
      break;
    case Role::occlusion:
      row.occlusion_deg = value;
      break;
    case Role::repetition:
      row.repetition = static_cast<int>(value);
      break;
  }
}

std::optional<double> number(std::string field, bool decimal_comma) {
  if (decimal_comma) std::replace(field.begin(), field.end(), ',', '.');
  return parse_number(field);
}

/// Why the value cannot stand in its role; empty: it can.
std::string objection(Role role, double value) {
  if (role == Role::occlusion && !(value >= 0 && value < 360)) return "the occlusion is outside 0 to 360 degrees";
  if (role == Role::repetition && !(value >= 1 && value <= 1000 && value == std::floor(value)))
    return "the repetition is no whole number from 1";
  return {};
}

/// Nothing, and the reason in the log, when the thrust is no number or a value is impossible.
std::optional<StandRow> read_row(const TableRow& fields, const std::vector<Mapped>& columns, bool decimal_comma,
                                 StandLog& log) {
  StandRow row{.line = fields.line};
  for (const Mapped& column : columns) {
    const auto value = number(fields.fields[column.column], decimal_comma);
    const bool needed = column.role == Role::thrust || column.role == Role::occlusion;
    if (!value && !needed) continue;
    const std::string why = value ? objection(column.role, *value * column.factor)
                                  : fmt::format("{} is no number", row_of(column.role).name);
    if (!why.empty()) {
      log.problems.push_back({fields.line, why + "; the line is left out"});
      return std::nullopt;
    }
    put(row, column.role, *value * column.factor);
  }
  return row;
}

bool has_role(const std::vector<Mapped>& columns, Role role) {
  return std::any_of(columns.begin(), columns.end(), [&](const Mapped& column) { return column.role == role; });
}

}  // namespace

ColumnRole parse_column_role(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string_view name = text.substr(0, equals);
  for (const RoleRow& row : kRoles) {
    if (name != row.name || equals == std::string_view::npos || equals + 1 == text.size()) continue;
    ColumnRole column{row.role, std::string(text.substr(equals + 1)), ""};
    const std::size_t colon = column.header.rfind(':');
    if (colon != std::string::npos && unit_factor(row.measure, column.header.substr(colon + 1)) &&
        row.measure != Measure::count) {
      column.unit = column.header.substr(colon + 1);
      column.header.resize(colon);
    }
    return column;
  }
  throw ConfigurationError(
      fmt::format("--column {}: expected ROLE=HEADER or ROLE=HEADER:UNIT with ROLE of {}", text, role_list()));
}

StandLog read_mapped(std::string_view text, std::string path, const std::vector<ColumnRole>& columns,
                     const CsvDialect& dialect) {
  const Table table = read_separated(text, std::move(path), dialect.separator);
  std::vector<Mapped> mapped;
  for (const ColumnRole& column : columns) {
    if (has_role(mapped, column.role)) refuse(table, fmt::format("--column names {} twice", row_of(column.role).name));
    mapped.push_back(map_column(table, column));
  }
  StandLog log;
  log.path = table.path;
  log.problems = table.problems;
  log.has_optical = has_role(mapped, Role::speed);
  log.has_electrical = has_role(mapped, Role::electrical_speed);
  if (!has_role(mapped, Role::thrust) || (!log.has_optical && !log.has_electrical))
    refuse(table, "a thrust and a speed are needed: --column thrust=HEADER --column speed=HEADER");
  for (const Mapped& column : mapped)
    if (column.role == Role::thrust) log.thrust_unit = column.unit;
  for (const TableRow& fields : table.rows)
    if (const auto row = read_row(fields, mapped, dialect.decimal_comma, log)) log.rows.push_back(*row);
  return log;
}

}  // namespace kphi::fit
