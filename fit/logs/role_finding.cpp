#include "fit/logs/role_finding.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/text.hpp"
#include "fit/logs/clock_time.hpp"

namespace kphi::fit {
namespace {

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
  RoleFinder(const std::string& path, const std::vector<TextLine>& lines, const TableShape& shape,
             const std::vector<ColumnRole>& hints, Layout& layout)
      : path_(path), lines_(lines), shape_(shape), hints_(hints), layout_(layout) {}

  void find() {
    for (const ColumnRole& wanted : hints_) take_hint(wanted);
    if (shape_.header)
      for (const Role role : {Role::speed, Role::electrical_speed, Role::thrust, Role::time, Role::throttle,
                              Role::torque, Role::voltage, Role::current, Role::occlusion, Role::repetition,
                              Role::target_speed, Role::propeller, Role::motor, Role::direction})
        if (!named(role)) look_for(role);
    require(Role::thrust);
    require(Role::speed);
    std::ranges::stable_sort(layout_.columns, {}, [](const LayoutColumn& column) { return column.role; });
  }

 private:
  [[nodiscard]] std::size_t line() const { return lines_[shape_.header.value_or(shape_.first)].number; }
  [[nodiscard]] bool named(Role role) const {
    const bool speed = role == Role::speed || role == Role::electrical_speed;
    return std::ranges::any_of(hints_, [&](const ColumnRole& hint) {
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
    const auto fields = fields_of(lines_[shape_.first].text, shape_.separator);
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
  const std::vector<TextLine>& lines_;
  const TableShape& shape_;
  const std::vector<ColumnRole>& hints_;
  Layout& layout_;
};

}  // namespace

void find_roles(const std::string& path, const std::vector<TextLine>& lines, const TableShape& shape,
                const std::vector<ColumnRole>& hints, Layout& layout) {
  RoleFinder(path, lines, shape, hints, layout).find();
}

}  // namespace kphi::fit
