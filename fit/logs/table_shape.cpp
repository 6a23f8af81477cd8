#include "fit/logs/table_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "base/number.hpp"
#include "fit/logs/column_roles.hpp"
#include "fit/logs/number_format.hpp"

namespace kphi::fit {
namespace {

constexpr std::array kComments{"#", "%", "//", "!"};

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

/// What is in a line, by one separator.
struct Content {
  std::size_t fields = 0, numbers = 0, words = 0;
  bool last_empty = false;
  bool comment = false;
  [[nodiscard]] bool row() const { return numbers >= 2 && !comment; }
};

Content content_of(const TextLine& line, char separator) {
  Content content;
  const std::vector<std::string> fields = fields_of(line.text, separator);
  content.comment = !line.comment.empty();
  content.fields = fields.size();
  content.last_empty = !fields.empty() && fields.back().empty();
  for (const std::string& field : fields) {
    if (says_nothing(field)) continue;
    ++(looks_like_number(field) ? content.numbers : content.words);
  }
  return content;
}

/// Names in a line of that many fields; empty if it is not one.
std::vector<std::string> names_in(std::string_view text, char separator, std::size_t fields) {
  std::vector<std::string> names = fields_of(text, separator);
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

void find_names(const std::vector<TextLine>& lines, const std::vector<Content>& contents, TableShape& shape) {
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
  const auto first = fields_of(lines[shape.first].text, shape.separator);
  if (shape.first + 1 < lines.size() &&
      counts_up({first.begin(), first.begin() + static_cast<std::ptrdiff_t>(std::min(first.size(), shape.fields))})) {
    shape.header = shape.first++;
    shape.names = first;
    shape.names.resize(shape.fields);
  }
}

TableShape shape_of(const std::vector<TextLine>& lines, char separator) {
  std::vector<Content> contents;
  std::map<std::size_t, std::size_t> counts;
  for (const TextLine& line : lines) {
    contents.push_back(content_of(line, separator));
    if (contents.back().row()) ++counts[contents.back().fields];
  }
  TableShape shape;
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

}  // namespace

void refuse_at(const std::string& path, std::size_t line, const std::string& what) {
  throw ConfigurationError(fmt::format("{}:{}: {}", path, std::max<std::size_t>(line, 1), what));
}

std::string_view bare(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin);
}

std::vector<TextLine> lines_of(std::string_view text, std::size_t most) {
  std::vector<TextLine> lines;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  for (std::size_t number = 1; !text.empty() && lines.size() < most; ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    const std::string_view content = bare(line);
    if (content.empty()) continue;
    TextLine one{number, line, {}};
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

std::vector<std::string> fields_of(std::string_view line, char separator) {
  auto fields = split_csv_line(line, separator);
  return fields ? std::move(*fields) : std::vector<std::string>{};
}

TableShape find_shape(const std::vector<TextLine>& lines, const std::string& path, char separator) {
  TableShape best;
  for (const char one : separator == '\0' ? std::string(",;\t| ") : std::string(1, separator)) {
    const TableShape shape = shape_of(lines, one);
    if (shape.score > best.score) best = shape;
  }
  if (best.score > 0) return best;
  refuse_at(path, 1,
            lines.empty() ? "no line with anything in it"
                          : fmt::format("no table: none of the first {} lines has two numbers{}", lines.size(),
                                        separator == '\0' ? ", with a comma, semicolon, tab, bar or blanks between them"
                                                          : " with that separator between them"));
}

}  // namespace kphi::fit
