#include "fit/logs/stand_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "base/error.hpp"
#include "base/ordered_work.hpp"
#include "base/statistics.hpp"
#include "base/text.hpp"
#include "fit/logs/clock_time.hpp"
#include "fit/logs/other_formats.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kMostRows = 10'000'000;  // 2 GB of memory
constexpr std::size_t kMostGroups = 1000;

/// A column and what makes readings of its fields.
struct Column {
  Role role{};
  Channel channel{};
  std::size_t index = 0;
  Unit unit;
};

/// How the rows of a table are read.
struct RowFormat {
  std::vector<Column> columns;
  NumberFormat numbers;
  double rotors = 1;
  bool grouped = false;
};

RowFormat format_of(const Layout& layout) {
  RowFormat format{{}, layout.numbers, static_cast<double>(layout.rotors())};
  for (const LayoutColumn& column : layout.columns) {
    format.columns.push_back(
        {column.role, channel_of(column.role), column.index, *unit_named(measure_of(column.role), column.unit)});
    format.grouped = format.grouped || is_text(column.role);
  }
  return format;
}

/// Why the value is impossible in its role; empty if it is possible.
std::string objection(Role role, double value) {
  if (role == Role::occlusion && !(value >= 0 && value < 360)) return "occlusion outside 0 to 360°";
  if (role == Role::repetition && !(value >= 1 && value <= 1000 && value == std::floor(value)))
    return "repetition is not a whole number from 1 to 1000";
  return {};
}

/// What one block of a log gives; `groups` of its own.
struct LogBlock {
  std::size_t bytes = 0;
  std::vector<StandRow> rows;
  std::vector<TableProblem> problems, not_numbers;
  std::vector<std::string> groups;
};

/// Why a field is not a number.
std::string not_a_number(const Column& column, std::string_view field, const NumberFormat& format) {
  if (field.empty()) return fmt::format("{} is missing", name_of(column.role));
  const bool other = looks_like_number(field);
  return fmt::format("{} {} is not a number{}", name_of(column.role), in_quotes(field),
                     other ? fmt::format(" as the others are written ({})", format.example()) : "");
}

/// Reads the rows of one block.
class BlockReader {
 public:
  BlockReader(const RowFormat& format, const std::string& path, LogBlock& block)
      : format_(format), path_(path), block_(block) {}

  void take(const RowView& fields) {
    StandRow row{.line = static_cast<std::uint32_t>(fields.line)};
    double squares = 0;
    group_.clear();
    for (const Column& column : format_.columns) {
      const std::string_view field = fields.fields[column.index];
      if (column.channel == nullptr && column.role != Role::thrust) {
        if (!group_.empty()) group_ += ", ";
        group_ += field.empty() ? "none" : field;
        continue;
      }
      const auto number = column.unit.clock ? clock_seconds(field) : format_.numbers.parse(field);
      if (!number) {
        if (!leave_out(column, field, fields.line)) continue;
        return;
      }
      const double value = *number * column.unit.factor + column.unit.offset;
      if (const std::string why = objection(column.role, value); !why.empty()) return skip(fields.line, why);
      if (column.role == Role::thrust) {
        row.thrust_n = format_.rotors > 1 ? value / format_.rotors : value;
      } else if (column.role == Role::speed && format_.rotors > 1) {
        squares += value * value;
        row.optical_rpm = std::sqrt(squares / format_.rotors);
      } else {
        row.*column.channel = value;
      }
    }
    if (format_.grouped) row.group = index_of(group_);
    block_.rows.push_back(row);
  }

 private:
  void skip(std::size_t line, const std::string& why) { block_.problems.push_back({line, why + "; line skipped"}); }

  /// Whether the line goes with the field.
  bool leave_out(const Column& column, std::string_view field, std::size_t line) {
    if (format_.numbers.decimal == '\0' && field.find_first_of(".,") != std::string::npos && looks_like_number(field)) {
      throw ConfigurationError(
          fmt::format("{}:{}: {} is the first number with a mark; say with --decimal point or "
                      "--decimal comma which one is before decimals",
                      path_, line, in_quotes(field)));
    }
    const bool needed = column.role == Role::thrust || column.role == Role::occlusion ||
                        (column.role == Role::speed && format_.rotors > 1);
    if (needed)
      skip(line, not_a_number(column, field, format_.numbers));
    else if (!field.empty())
      block_.not_numbers.push_back({line, not_a_number(column, field, format_.numbers)});
    return needed;
  }

  std::uint32_t index_of(const std::string& group) {
    if (block_.groups.empty() || block_.groups[last_] != group) {
      const auto found = std::ranges::find(block_.groups, group);
      last_ = static_cast<std::size_t>(found - block_.groups.begin());
      if (found == block_.groups.end()) block_.groups.push_back(group);
      if (block_.groups.size() > kMostGroups)
        throw ConfigurationError(
            fmt::format("{}: more than {} different propellers, motors and directions", path_, kMostGroups));
    }
    return static_cast<std::uint32_t>(last_);
  }

  const RowFormat& format_;
  const std::string& path_;
  LogBlock& block_;
  std::string group_;
  std::size_t last_ = 0;
};

LogBlock read_block(const Table& begin, std::string_view text, std::size_t line, const Layout& layout,
                    const RowFormat& format) {
  LogBlock block;
  block.bytes = text.size();
  BlockReader reader(format, begin.path, block);
  Table table = read_csv_rows(
      begin, text, line, layout.separator, [&](const Table&, const RowView& fields) { reader.take(fields); },
      layout.comment);
  block.problems.insert(block.problems.begin(), table.problems.begin(), table.problems.end());
  std::ranges::stable_sort(block.problems, {}, &TableProblem::line);
  return block;
}

void append(StandLog& log, LogBlock block) {
  const auto move_to = [](auto& to, auto& from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  std::vector<std::uint32_t> places;
  if (!block.groups.empty() && log.rows.empty()) log.groups.clear();
  for (const std::string& group : block.groups) {
    const auto found = std::ranges::find(log.groups, group);
    places.push_back(static_cast<std::uint32_t>(found - log.groups.begin()));
    if (found == log.groups.end()) log.groups.push_back(group);
  }
  if (!places.empty())
    for (StandRow& row : block.rows) row.group = places[row.group];
  move_to(log.rows, block.rows);
  move_to(log.problems, block.problems);
  move_to(log.not_numbers, block.not_numbers);
}

std::size_t line_ends(std::string_view text) {
  std::size_t n = 0;
  for (std::size_t at = text.find('\n'); at != std::string_view::npos; at = text.find('\n', at + 1)) ++n;
  return n;
}

/// The lines before the first row taken off the text; how many.
std::size_t drop_lines(std::string_view& text, std::size_t most) {
  std::size_t dropped = 0;
  for (; dropped < most && !text.empty(); ++dropped) text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  return dropped;
}

void require_names(std::string_view begin, const std::string& path, const Layout& layout) {
  if (layout.header_line == 0) return;
  std::string_view rest = begin;
  if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);
  drop_lines(rest, layout.header_line - 1);
  std::string_view line = rest.substr(0, rest.find('\n'));
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  const auto names = split_csv_line(line, layout.separator).value_or(std::vector<std::string>{});
  for (const LayoutColumn& column : layout.columns) {
    const std::string there = column.index < names.size() ? names[column.index] : std::string();
    if (column.name.empty() || there == column.name || (layout.separator == ' ' && layout.comment.empty())) continue;
    if (!layout.comment.empty() && line.find(column.name) != std::string_view::npos) continue;
    throw ConfigurationError(fmt::format("{}:{}: column {} is {}, but {} by the layout; this table has another layout",
                                         path, layout.header_line, column.index + 1, in_quotes(there),
                                         in_quotes(column.name)));
  }
}

/// `text` is UTF-8. A thread per processor reads blocks.
StandLog read_rows(TextBlocks text, const std::string& path, Layout layout) {
  StandLog log{.path = path,
               .thrust_unit = layout.all(Role::thrust).front().unit,
               .has_electrical = layout.has(Role::electrical_speed),
               .has_optical = layout.has(Role::speed)};
  const RowFormat format = format_of(layout);
  const Table begin{
      path, std::max<std::size_t>(layout.header_line, 1), std::vector<std::string>(layout.fields), {}, {}};
  OrderedWork<LogBlock> blocks([&](LogBlock block) {
    if (log.rows.empty() && block.bytes > 0)
      log.rows.reserve(std::min(kMostRows, block.rows.size() * (text.bytes() / block.bytes + 1)));
    if (log.rows.size() + block.rows.size() > kMostRows) {
      throw ConfigurationError(
          fmt::format("{}: more than {} million rows; import it in parts", log.path, kMostRows / 1'000'000));
    }
    append(log, std::move(block));
  });
  std::size_t line = 1;
  std::string_view block = text.front();
  if (block.starts_with("\xEF\xBB\xBF")) block.remove_prefix(3);
  for (; !text.front().empty(); text.pop(), block = text.front()) {
    if (line < layout.first_row) line += drop_lines(block, layout.first_row - line);
    blocks.add(launch_for(block.size()), [&begin, &format, &layout, line, text = std::string(block)] {
      return read_block(begin, text, line, layout, format);
    });
    line += line_ends(block);
  }
  blocks.finish();
  log.unread = layout.unread;
  log.layout = std::move(layout);
  return log;
}

}  // namespace

Channel channel_of(Role role) {
  static constexpr std::pair<Role, Channel> kChannels[]{
      {Role::time, &StandRow::time_s},           {Role::throttle, &StandRow::throttle_us},
      {Role::speed, &StandRow::optical_rpm},     {Role::electrical_speed, &StandRow::electrical_rpm},
      {Role::torque, &StandRow::torque_nm},      {Role::voltage, &StandRow::voltage_v},
      {Role::current, &StandRow::current_a},     {Role::occlusion, &StandRow::occlusion_deg},
      {Role::repetition, &StandRow::repetition}, {Role::target_speed, &StandRow::target_rpm}};
  const auto found = std::ranges::find(kChannels, role, &std::pair<Role, Channel>::first);
  return found == std::end(kChannels) ? nullptr : found->second;
}

bool motor_off(const StandRow& row, SpeedSource source) {
  return row.throttle_us && *row.throttle_us <= kIdleUs && rpm_of(row, source).value_or(0) == 0;
}

double largest_thrust(const StandLog& log) {
  double largest = 0;
  for (const StandRow& row : log.rows) largest = std::max(largest, std::abs(row.thrust_n));
  return largest;
}

StandLog read_log(TextBlocks text, const std::string& path, const LayoutHints& hints) {
  refuse_other_formats(text.front(), path);
  const Encoding encoding = encoding_of(text.front());
  TextBlocks utf8 = as_utf8(std::move(text), encoding);
  Layout layout = find_layout(utf8.front(), path, hints);
  layout.encoding = encoding;
  return read_rows(std::move(utf8), path, std::move(layout));
}

StandLog read_log(TextBlocks text, const std::string& path, const Layout& layout) {
  refuse_other_formats(text.front(), path);
  TextBlocks utf8 = as_utf8(std::move(text), layout.encoding);
  require_names(utf8.front(), path, layout);
  return read_rows(std::move(utf8), path, layout);
}

}  // namespace kphi::fit
