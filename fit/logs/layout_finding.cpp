#include "fit/logs/layout_finding.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "base/number.hpp"
#include "base/statistics.hpp"
#include "base/text.hpp"
#include "compensation/units.hpp"
#include "fit/logs/clock_time.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kLinesLooked = 500;  // a preamble is shorter
constexpr std::array kComments{"#", "%", "//", "!"};

[[noreturn]] void refuse_at(const std::string& path, std::size_t line, const std::string& what) {
  throw ConfigurationError(fmt::format("{}:{}: {}", path, std::max<std::size_t>(line, 1), what));
}

struct Line {
  std::size_t number = 0;
  std::string_view text;
  std::string_view comment;  ///< the sign that it begins with
};

std::string_view bare(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin);
}

/// The lines that are not blank.
std::vector<Line> lines_of(std::string_view text, std::size_t most) {
  std::vector<Line> lines;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  for (std::size_t number = 1; !text.empty() && lines.size() < most; ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    const std::string_view content = bare(line);
    if (content.empty()) continue;
    Line one{number, line, {}};
    for (const std::string_view sign : kComments)
      if (content.starts_with(sign)) one.comment = sign;
    lines.push_back(one);
  }
  return lines;
}

bool says_nothing(const std::string& field) {
  constexpr std::array kEmpty{"", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "-", "--", "null", "None", "inf", "-inf"};
  return std::ranges::any_of(kEmpty, [&](const char* empty) { return field == empty; });
}

/// "Time (s) Thrust (N)" has two names where blanks separate.
std::vector<std::string> with_units_joined(std::vector<std::string> names) {
  for (std::size_t i = 1; i < names.size();) {
    if (names[i].size() > 1 && (names[i].front() == '(' || names[i].front() == '[')) {
      names[i - 1] += " " + names[i];
      names.erase(names.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
  return names;
}

std::vector<std::string> split(std::string_view line, char separator) {
  auto fields = split_csv_line(line, separator);
  return fields ? std::move(*fields) : std::vector<std::string>{};
}

/// What is in a line, by one separator.
struct Content {
  std::size_t fields = 0, numbers = 0, words = 0;
  bool last_empty = false;
  bool comment = false;
  [[nodiscard]] bool row() const { return numbers >= 2 && !comment; }
};

Content content_of(const Line& line, char separator) {
  Content content;
  const std::vector<std::string> fields = split(line.text, separator);
  content.comment = !line.comment.empty();
  content.fields = fields.size();
  content.last_empty = !fields.empty() && fields.back().empty();
  for (const std::string& field : fields) {
    if (says_nothing(field)) continue;
    ++(looks_like_number(field) ? content.numbers : content.words);
  }
  return content;
}

/// A table in the lines, by one separator.
struct Shape {
  char separator = ',';
  std::size_t fields = 0;
  bool open_end = false;  ///< every row ends with an empty field, which `fields` does not count
  std::size_t first = 0;  ///< row, index into the lines
  std::optional<std::size_t> header{}, units{}, misfit{};  ///< lines; misfit: text above the rows of other fields
  std::vector<std::string> names, unit_names;
  double score = 0;
};

/// Names in a line of that many fields; empty if it is not one.
std::vector<std::string> names_in(std::string_view text, char separator, std::size_t fields) {
  std::vector<std::string> names = split(text, separator);
  if (separator == ' ' && names.size() > fields) names = with_units_joined(std::move(names));
  if (names.size() == fields + 1 && names.back().empty()) names.pop_back();
  std::size_t words = 0;
  for (const std::string& name : names) {
    if (!says_nothing(name) && looks_like_number(name)) return {};
    words += name.empty() ? 0 : 1;
  }
  return names.size() == fields && 2 * words >= std::min<std::size_t>(fields, 4) ? names : std::vector<std::string>{};
}

/// "0,1,2" or "1,2,3" above other numbers: names of columns.
bool counts_up(const std::vector<std::string>& names) {
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] != fmt::format("{}", i) && names[i] != fmt::format("{}", i + 1)) return false;
  return names.size() > 1 && (names.front() == "0") == (names.back() == fmt::format("{}", names.size() - 1));
}

bool mostly_units(const std::vector<std::string>& names) {
  std::size_t units = 0, words = 0;
  for (const std::string& name : names) {
    words += name.empty() ? 0 : 1;
    units += is_unit(name) ? 1 : 0;
  }
  return words > 0 && 2 * units >= words + 1;
}

void find_names(const std::vector<Line>& lines, const std::vector<Content>& contents, Shape& shape) {
  constexpr int kOddRows = 3;  // first rows that do not fit
  int odd = 0;
  std::optional<std::size_t> comment;
  for (std::size_t i = shape.first; i-- > 0;) {
    if (contents[i].comment) {
      // "%;g;RPM" is a line of units.
      const auto perhaps = names_in(lines[i].text, shape.separator, shape.fields);
      if (!shape.units && mostly_units(perhaps)) {
        shape.units = i;
        shape.unit_names = perhaps;
      } else if (!comment) {
        comment = i;
      }
      continue;
    }
    if (contents[i].row() && contents[i].fields != shape.fields && odd++ < kOddRows) continue;
    auto names = names_in(lines[i].text, shape.separator, shape.fields);
    if (names.empty() && shape.open_end) {
      // The last column has a name, and nothing in any row.
      names = names_in(lines[i].text, shape.separator, shape.fields + 1);
      shape.fields += names.empty() ? 0 : 1;
      shape.open_end = names.empty();
    }
    if (names.empty()) {
      shape.misfit = i;
      break;
    }
    if (!shape.units && !shape.header && mostly_units(names)) {
      shape.units = i;
      shape.unit_names = names;
      continue;
    }
    shape.header = i;
    shape.names = names;
    break;
  }
  if (!shape.header && comment) {
    std::string_view text = bare(lines[*comment].text);
    text.remove_prefix(lines[*comment].comment.size());
    shape.names = names_in(bare(text), shape.separator, shape.fields);
    if (!shape.names.empty()) shape.header = comment;
  }
  if (!shape.header && shape.units) {
    // Names that are units: "RPM;N" alone above the rows.
    shape.header = std::exchange(shape.units, std::nullopt);
    shape.names = std::exchange(shape.unit_names, {});
  }
  if (shape.header) return;
  const auto first = split(lines[shape.first].text, shape.separator);
  if (shape.first + 1 < lines.size() &&
      counts_up({first.begin(), first.begin() + static_cast<std::ptrdiff_t>(std::min(first.size(), shape.fields))})) {
    shape.header = shape.first++;
    shape.names = first;
    shape.names.resize(shape.fields);
  }
}

Shape shape_of(const std::vector<Line>& lines, char separator) {
  std::vector<Content> contents;
  std::map<std::size_t, std::size_t> counts;
  for (const Line& line : lines) {
    contents.push_back(content_of(line, separator));
    if (contents.back().row()) ++counts[contents.back().fields];
  }
  Shape shape;
  shape.separator = separator;
  if (counts.empty()) return shape;
  const auto most = std::ranges::max_element(counts, {}, [](const auto& one) { return one.second; });
  const std::size_t fields = most->first;
  bool open_end = true;
  double numbers = 0, words = 0;
  std::size_t longest = 0, run = 0;
  std::vector<std::size_t> runs(lines.size());
  for (std::size_t i = lines.size(); i-- > 0;) {
    const Content& one = contents[i];
    const bool fits = one.row() && one.fields == fields;
    run = fits ? run + 1 : one.comment ? run : 0;
    runs[i] = fits ? run : 0;
    longest = std::max(longest, run);
    if (!fits) continue;
    open_end = open_end && one.last_empty;
    numbers += static_cast<double>(one.numbers), words += static_cast<double>(one.words);
  }
  const std::size_t enough = std::min<std::size_t>(longest, 2);
  shape.open_end = open_end && fields > 2;
  shape.fields = shape.open_end ? fields - 1 : fields;
  shape.first =
      static_cast<std::size_t>(std::ranges::find_if(runs, [&](std::size_t n) { return n >= enough; }) - runs.begin());
  find_names(lines, contents, shape);
  // Blanks are inside of names and of grouped numbers, too.
  const double likely = separator == ' ' ? 0.7 : 1;
  shape.score = likely * static_cast<double>(most->second) * numbers / (numbers + words) * (shape.header ? 2 : 1) *
                (1 + 1e-3 * static_cast<double>(std::min<std::size_t>(shape.fields, 100)));
  return shape;
}

Shape best_shape(const std::vector<Line>& lines, const std::string& path, char separator) {
  Shape best;
  for (const char one : separator == '\0' ? std::string(",;\t| ") : std::string(1, separator)) {
    const Shape shape = shape_of(lines, one);
    if (shape.score > best.score) best = shape;
  }
  if (best.score > 0) return best;
  refuse_at(path, 1,
            lines.empty() ? "no line with anything in it"
                          : fmt::format("no table: none of the first {} lines has two numbers{}", lines.size(),
                                        separator == '\0' ? ", with a comma, semicolon, tab, bar or blanks between them"
                                                          : " with that separator between them"));
}

/// The first of these names, for a message.
std::string list_of(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 40;
  std::string list;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) list += (i == 0 ? "" : ", ") + in_quotes(names[i]);
  return names.size() <= kShown ? list : list + fmt::format(" and {} more", names.size() - kShown);
}

/// A column that may have a role.
struct Candidate {
  std::size_t index = 0;
  int rank = 0;
  std::string unit;    ///< as written; empty: none
  bool known = false;  ///< the unit is one of the measure
};

/// Gives the columns of a table their roles.
class RoleFinder {
 public:
  RoleFinder(const std::string& path, const std::vector<Line>& lines, const Shape& shape, const LayoutHints& hints,
             Layout& layout)
      : path_(path), lines_(lines), shape_(shape), hints_(hints), layout_(layout) {}

  void find() {
    for (const ColumnRole& wanted : hints_.columns) take_hint(wanted);
    if (shape_.header) {
      for (const Role role : {Role::speed, Role::electrical_speed, Role::thrust, Role::time, Role::throttle,
                              Role::torque, Role::voltage, Role::current, Role::occlusion, Role::repetition,
                              Role::target_speed, Role::propeller, Role::motor, Role::direction})
        if (!named(role)) look_for(role);
    }
    require(Role::thrust);
    require(Role::speed);
    std::ranges::stable_sort(layout_.columns, {}, [](const LayoutColumn& column) { return column.role; });
  }

 private:
  [[nodiscard]] std::size_t line() const { return lines_[shape_.header.value_or(shape_.first)].number; }
  [[nodiscard]] bool named(Role role) const {
    const bool speed = role == Role::speed || role == Role::electrical_speed;
    return std::ranges::any_of(hints_.columns, [&](const ColumnRole& hint) {
      return hint.role == role || (speed && (hint.role == Role::speed || hint.role == Role::electrical_speed));
    });
  }
  [[nodiscard]] std::string unit_of(std::size_t index, Measure measure) const {
    std::string unit = shape_.names.empty() ? "" : unit_in(shape_.names[index], measure);
    if ((unit.empty() || !unit_named(measure, unit)) && index < shape_.unit_names.size())
      if (const std::string& below = shape_.unit_names[index]; !says_nothing(below))
        unit = split_header(below).unit.empty() ? below : split_header(below).unit;
    return unit;
  }
  [[nodiscard]] std::string first_field(std::size_t index) const {
    const auto fields = split(lines_[shape_.first].text, shape_.separator);
    return index < fields.size() ? fields[index] : std::string();
  }

  [[nodiscard]] std::size_t index_named(const std::string& name) const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < shape_.names.size(); ++i)
      if (shape_.names[i] == name) found.push_back(i);
    for (std::size_t i = 0; found.empty() && i < shape_.names.size(); ++i)
      if (split_header(shape_.names[i]).name == name) found.push_back(i);
    if (found.size() == 1) return found.front();
    const auto number = parse_integer<std::size_t>(name);
    if (found.empty() && shape_.names.empty() && number && *number >= 1 && *number <= shape_.fields) return *number - 1;
    refuse_at(path_, line(),
              shape_.names.empty()
                  ? fmt::format("no column {}: there is no line of names above the rows, whose columns are 1 to {}",
                                in_quotes(name), shape_.fields)
                  : fmt::format("{} column {}; the file has {}", found.empty() ? "no" : "more than one",
                                in_quotes(name), list_of(shape_.names)));
  }

  void take_hint(const ColumnRole& wanted) {
    const Measure measure = measure_of(wanted.role);
    const std::size_t index = index_named(wanted.header);
    if (wanted.role != Role::speed && layout_.has(wanted.role))
      refuse_at(path_, line(), fmt::format("--column names {} twice", name_of(wanted.role)));
    const std::string header = shape_.names.empty() ? wanted.header : shape_.names[index];
    const std::string there = unit_of(index, measure), unit = wanted.unit.empty() ? there : wanted.unit;
    if (wanted.role == Role::time && wanted.unit.empty() && clock_seconds(first_field(index)))
      return add(wanted.role, index, "clock");
    const auto known = unit_named(measure, unit);
    if (!known && unit.empty()) {
      refuse_at(path_, line(),
                fmt::format("no unit given for column {}; name it: --column {}={}:UNIT with UNIT one of {}",
                            in_quotes(header), name_of(wanted.role), wanted.header, unit_list(measure)));
    }
    if (!known)
      refuse_at(path_, line(),
                fmt::format("unknown unit {} of column {}; known are {}", in_quotes(unit), in_quotes(header),
                            unit_list(measure)));
    const auto by_header = unit_named(measure, there);
    if (by_header && *by_header != *known) {
      refuse_at(path_, line(),
                fmt::format("unit mismatch: column {} is in {} by its header and in {} by --column; correct one",
                            in_quotes(header), there, unit));
    }
    add(wanted.role, index, measure == Measure::count ? "" : unit);
  }

  void add(Role role, std::size_t index, const std::string& unit) {
    layout_.columns.push_back({role, index, shape_.names.empty() ? "" : shape_.names[index], unit});
  }
  void leave(std::size_t index, const std::string& why) {
    layout_.unread.push_back(fmt::format("column {}: {}", in_quotes(shape_.names[index]), why));
  }
  [[nodiscard]] bool taken(std::size_t index) const {
    return std::ranges::any_of(layout_.columns, [&](const auto& column) { return column.index == index; });
  }

  [[nodiscard]] std::vector<Candidate> candidates(Role role) const {
    std::vector<Candidate> found;
    for (std::size_t i = 0; i < shape_.names.size(); ++i) {
      if (taken(i) || (role == Role::speed && counts_electrical_turns(shape_.names[i]))) continue;
      for (const NameMatch& match : roles_of(shape_.names[i])) {
        if (match.role != role) continue;
        Candidate one{i, 10 * match.certainty, unit_of(i, measure_of(role)), false};
        one.known = unit_named(measure_of(role), one.unit).has_value() &&
                    (!one.unit.empty() || measure_of(role) == Measure::count);
        one.rank += one.known ? 5 : one.unit.empty() ? 0 : -9;
        found.push_back(one);
      }
    }
    std::ranges::stable_sort(found, std::greater<>(), &Candidate::rank);
    return found;
  }

  void look_for(Role role) {
    std::vector<Candidate> found = candidates(role);
    if (found.empty()) return;
    const bool vital = role == Role::thrust || role == Role::speed || role == Role::occlusion;
    const Candidate best = found.front();
    std::erase_if(found, [&](const Candidate& one) { return one.rank < best.rank; });
    const std::string name = in_quotes(shape_.names[best.index]);
    if (role == Role::electrical_speed && counts_electrical_turns(shape_.names[best.index])) return electrical(found);
    if (found.size() > 1) return several(role, found, vital);
    if (role == Role::time && clock_seconds(first_field(best.index))) return add(role, best.index, "clock");
    if (best.known) return add(role, best.index, measure_of(role) == Measure::count ? "" : best.unit);
    if (!best.unit.empty()) {
      const std::string what = fmt::format("unknown unit {} of column {}; known are {}", in_quotes(best.unit), name,
                                           unit_list(measure_of(role)));
      if (vital || role == Role::electrical_speed) refuse_at(path_, line(), what);
      layout_.unread.push_back(what);
    } else if (vital) {
      refuse_at(path_, line(),
                fmt::format("no unit given for column {}; name it: --column {}={}:UNIT with UNIT one of {}", name,
                            name_of(role), shape_.names[best.index], unit_list(measure_of(role))));
    } else if (role == Role::throttle) {
      add(role, best.index, "");  // its values may tell
    } else {
      leave(best.index,
            fmt::format("no unit given; --column '{}={}:UNIT' reads it", name_of(role), shape_.names[best.index]));
    }
  }

  void electrical(const std::vector<Candidate>& found) {
    for (const Candidate& one : found) {
      const std::string why = "counts turns of the field, pole pairs times those of the rotor";
      if (layout_.has(Role::speed)) {
        leave(one.index, why);
        continue;
      }
      refuse_at(path_, line(),
                fmt::format("column {} {}: k would be wrong by their square; for a motor of 14 poles: --column "
                            "'electrical_speed={}:RPM' --speed-factor 1/7",
                            in_quotes(shape_.names[one.index]), why, shape_.names[one.index]));
    }
  }

  void several(Role role, const std::vector<Candidate>& found, bool vital) {
    const auto kind = without_digits(shape_.names[found.front().index]);
    const bool rotors =
        role == Role::speed && found.front().known && found.size() <= 16 &&
        std::ranges::all_of(found, [&](const Candidate& one) {
          return kind && without_digits(shape_.names[one.index]) == kind && one.unit == found.front().unit;
        });
    std::vector<std::string> names;
    for (const Candidate& one : found) {
      names.push_back(shape_.names[one.index]);
      if (rotors) add(role, one.index, one.unit);
    }
    if (rotors) return;
    const std::string what = fmt::format("{} columns may be the {}: {}", found.size(), name_of(role), list_of(names));
    if (vital || (role == Role::electrical_speed && !layout_.has(Role::speed)))
      refuse_at(path_, line(), fmt::format("{}; name the one: --column '{}={}'", what, name_of(role), names.front()));
    layout_.unread.push_back(what);
  }

  void require(Role role) {
    if (layout_.has(role) || (role == Role::speed && layout_.has(Role::electrical_speed))) return;
    const char* name = name_of(role);
    if (!shape_.header) {
      const std::string above = shape_.misfit
                                    ? fmt::format("line {} above the rows has another number of fields than these ({})",
                                                  lines_[*shape_.misfit].number, shape_.fields)
                                    : "there is no line of names above the rows";
      refuse_at(
          path_, line(),
          fmt::format("{}; name the columns by their number: --column thrust=1:UNIT --column speed=2:UNIT; the first "
                      "row is {}{}",
                      above, in_quotes(bare(lines_[shape_.first].text)),
                      shape_.separator == ',' && shape_.misfit ? "; if the comma is the decimal mark as well, export "
                                                                 "it with another separator"
                                                               : ""));
    }
    refuse_at(path_, line(),
              fmt::format("no column is surely the {}; name it: --column {}=HEADER:UNIT; the file has {}", name, name,
                          list_of(shape_.names)));
  }

  const std::string& path_;
  const std::vector<Line>& lines_;
  const Shape& shape_;
  const LayoutHints& hints_;
  Layout& layout_;
};

using SampleRows = std::vector<std::pair<std::size_t, std::vector<std::string>>>;  ///< line and fields

SampleRows rows_of(std::string_view text, const Layout& layout) {
  SampleRows rows;
  for (const Line& line : lines_of(text, std::string_view::npos)) {
    if (line.number < layout.first_row || (!layout.comment.empty() && line.comment == layout.comment)) continue;
    std::vector<std::string> fields = split(line.text, layout.separator);
    if (fields.size() == layout.fields + 1 && fields.back().empty()) fields.pop_back();
    if (fields.size() == layout.fields) rows.emplace_back(line.number, std::move(fields));
  }
  return rows;
}

/// k by these rows, read with the format; 0 if they give none.
double k_of(const SampleRows& rows, const Layout& layout, const NumberFormat& format) {
  const auto thrust = layout.all(Role::thrust).front();
  const auto speeds = layout.has(Role::speed) ? layout.all(Role::speed) : layout.all(Role::electrical_speed);
  double products = 0, squares = 0;
  for (const auto& [line, fields] : rows) {
    const auto newtons = format.parse(fields[thrust.index]);
    double omega2 = 0;
    for (const LayoutColumn& speed : speeds) {
      const double rpm = format.parse(fields[speed.index]).value_or(0) * unit_named(Measure::speed, speed.unit)->factor;
      omega2 += square(from_rpm(rpm).value());
    }
    if (!newtons) continue;
    products += *newtons * unit_named(Measure::thrust, thrust.unit)->factor * omega2;
    squares += omega2 * omega2;
  }
  return squares > 0 ? std::abs(products / squares) : 0;
}

[[noreturn]] void ask_for_mark(const std::string& path, const SampleRows& rows, const Layout& layout,
                               const MarkEvidence& evidence) {
  const char mark = evidence.open_mark();
  const auto& [field, line] = evidence.either(mark);
  const NumberFormat point = evidence.format_with('.'), comma = evidence.format_with(',');
  refuse_at(path, line,
            fmt::format("\"{}\" can be {} or {}: no number of the table tells whether its \"{}\" is before decimals or "
                        "between thousands; k would be {:.2g} or {:.2g} N/(rad/s)^2; say which with --decimal point or "
                        "--decimal comma",
                        field, shortest(*point.parse(field)), shortest(*comma.parse(field)), mark,
                        k_of(rows, layout, point), k_of(rows, layout, comma)));
}

NumberFormat marks_of(const std::string& path, const SampleRows& rows, const Layout& layout, const LayoutHints& hints) {
  MarkEvidence evidence;
  for (const auto& [line, fields] : rows)
    for (const LayoutColumn& column : layout.columns)
      if (!is_text(column.role) && column.unit != "clock") evidence.add(fields[column.index], line);
  if (hints.decimal) return evidence.format_with(*hints.decimal);
  const auto format = evidence.format();
  if (!format) {
    const auto &point = evidence.decimal('.'), &comma = evidence.decimal(',');
    refuse_at(
        path, std::max(point.line, comma.line),
        point.line > 0 && comma.line > 0
            ? fmt::format("\"{}\" (line {}) has a decimal point and \"{}\" (line {}) a decimal comma; say which is "
                          "right with --decimal point or --decimal comma, or correct the file",
                          point.field, point.line, comma.field, comma.line)
            : "numbers of the table group their thousands in two ways; say which mark is before decimals with "
              "--decimal point or --decimal comma");
  }
  // Where a comma is the decimal mark, nobody separates fields by bare commas.
  const bool by_separator = layout.separator == ',' && evidence.open_mark() == '.';
  if (evidence.open_mark() != '\0' && !by_separator) ask_for_mark(path, rows, layout, evidence);
  return *format;
}

/// Of a throttle without one: µs from 900 to 2200, a share up to 1, percent up to 100; empty: none of these surely.
std::string throttle_unit(const SampleRows& rows, const LayoutColumn& column, const NumberFormat& format) {
  double lowest = 1e300, highest = -1e300;
  bool fraction = false;
  for (const auto& [line, fields] : rows) {
    const auto value = format.parse(fields[column.index]);
    if (!value) continue;
    lowest = std::min(lowest, *value), highest = std::max(highest, *value);
    fraction = fraction || *value != std::floor(*value);
  }
  if (lowest >= 900 && highest <= 2200 && highest > 1050) return "us";
  if (lowest >= 0 && highest > 1.5 && highest <= 100 && highest >= 20) return "%";
  return lowest >= 0 && highest <= 1 && fraction && highest > 0.2 ? "0..1" : "";
}

struct Magic {
  std::string_view bytes;
  const char* what;
};

constexpr Magic kMagics[]{
    {"PK\x03\x04",
     "an Excel workbook or another zip archive; save its sheet as CSV, or `libreoffice --headless "
     "--convert-to csv FILE`, and import that"},
    {"\xD0\xCF\x11\xE0",
     "an old Excel workbook; save its sheet as CSV, or `libreoffice --headless --convert-to csv "
     "FILE`, and import that"},
    {"\x1F\x8B", "compressed by gzip; `gunzip -k FILE` and import what it gives"},
    {"BZh", "compressed by bzip2; `bunzip2 -k FILE` and import what it gives"},
    {"\xFD"
     "7zXZ",
     "compressed by xz; `unxz -k FILE` and import what it gives"},
    {"\x28\xB5\x2F\xFD", "compressed by zstd; `unzstd FILE` and import what it gives"},
    {"ULog\x01\x12\x35", "a flight log of PX4 (ULog), which has no measured thrust; kphi imports tables of a stand"},
    {"\x89HDF\r\n",
     "an HDF5 file; a run of kphi is read by `kphi info`, a table in another one is exported with "
     "h5dump or h5py as CSV"},
    {"PAR1", "a Parquet file; write it as CSV (pandas: read_parquet, to_csv) and import that"},
    {"MATLAB 5.0", "a MATLAB file; write its table as CSV (writetable) and import that"},
    {"SQLite format 3", "an SQLite database; write its table as CSV (sqlite3 -csv) and import that"},
    {"%PDF", "a PDF; export the table from the program that made it as CSV"},
    {"H Product:Blackbox",
     "a blackbox log of Betaflight, which has no measured thrust; kphi imports tables of a stand"}};

}  // namespace

void refuse_other_formats(std::string_view begin, const std::string& path) {
  for (const Magic& magic : kMagics)
    if (begin.starts_with(magic.bytes)) throw ConfigurationError(fmt::format("{}: {}", path, magic.what));
  const std::size_t nul = begin.find('\0');
  if (nul == std::string_view::npos || encoding_of(begin) == Encoding::utf16le ||
      encoding_of(begin) == Encoding::utf16be)
    return;
  refuse_at(path, 1 + static_cast<std::size_t>(std::ranges::count(begin.substr(0, nul), '\n')),
            fmt::format("a NUL byte, byte {} of the file: not a table of text", nul + 1));
}

Layout find_layout(std::string_view begin, const std::string& path, const LayoutHints& hints) {
  const std::vector<Line> lines = lines_of(begin, kLinesLooked);
  const Shape shape = best_shape(lines, path, hints.separator);
  Layout layout;
  layout.separator = shape.separator;
  layout.fields = shape.fields;
  layout.header = shape.names;
  layout.header_line = shape.header ? lines[*shape.header].number : 0;
  layout.units_line = shape.units ? lines[*shape.units].number : 0;
  const std::size_t above = std::max(layout.header_line, layout.units_line);
  layout.first_row = above > 0 ? above + 1 : lines[shape.first].number;
  for (const Line& line : lines)
    if (layout.comment.empty() && line.number != layout.units_line) layout.comment = line.comment;
  RoleFinder(path, lines, shape, hints, layout).find();
  const SampleRows rows = rows_of(begin, layout);
  layout.numbers = marks_of(path, rows, layout, hints);
  for (LayoutColumn& column : layout.columns) {
    if (column.role != Role::throttle || !column.unit.empty()) continue;
    column.unit = throttle_unit(rows, column, layout.numbers);
    if (column.unit.empty())
      layout.unread.push_back(
          fmt::format("column {}: a throttle in no known unit; --column 'throttle={}:UNIT' reads it",
                      in_quotes(column.name), column.name));
  }
  std::erase_if(layout.columns,
                [](const auto& column) { return column.role == Role::throttle && column.unit.empty(); });
  return layout;
}

}  // namespace kphi::fit
