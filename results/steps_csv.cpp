#include "results/steps_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "base/error.hpp"
#include "base/number.hpp"

namespace kphi::results {
namespace {

struct Flags {
  std::uint32_t StepMean::*member;
};
using Field =
    std::variant<std::string StepMean::*, int StepMean::*, std::uint64_t StepMean::*, double StepMean::*, Flags>;

struct Column {
  const char* name;
  Field field;
};

const std::array kColumns{
    Column{"propeller", &StepMean::propeller},
    Column{"blades", &StepMean::blades},
    Column{"diameter_in", &StepMean::diameter_in},
    Column{"occlusion_deg", &StepMean::occlusion_deg},
    Column{"repetition", &StepMean::repetition},
    Column{"step", &StepMean::step},
    Column{"commanded_speed_rad_s", &StepMean::commanded_speed_rad_s},
    Column{"speed_rad_s", &StepMean::speed_rad_s},
    Column{"speed_sd_rad_s", &StepMean::speed_sd_rad_s},
    Column{"speed_n", &StepMean::speed_n},
    Column{"thrust_n", &StepMean::thrust_n},
    Column{"thrust_sd_n", &StepMean::thrust_sd_n},
    Column{"thrust_samples", &StepMean::thrust_samples},
    Column{"torque_nm", &StepMean::torque_nm},
    Column{"torque_sd_nm", &StepMean::torque_sd_nm},
    Column{"zero_n", &StepMean::zero_n},
    Column{"supply_voltage_v", &StepMean::supply_voltage_v},
    Column{"supply_current_a", &StepMean::supply_current_a},
    Column{"motor_current_a", &StepMean::motor_current_a},
    Column{"coil_temperature_degc", &StepMean::coil_temperature_degc},
    Column{"window_begin_s", &StepMean::window_begin_s},
    Column{"window_end_s", &StepMean::window_end_s},
    Column{"quality_flags", Flags{&StepMean::quality_flags}},
};

/// Columns that are written if any step has a value for the first of them.
struct Group {
  std::vector<Column> columns;
  [[nodiscard]] bool in(const StepMean& step) const {
    return !std::isnan(step.*std::get<double StepMean::*>(columns.front().field));
  }
};

const std::array kGroups{
    Group{{Column{"supply_v", &StepMean::supply_v}, Column{"supply_a", &StepMean::supply_a},
           Column{"supply_w", &StepMean::supply_w}}},
    Group{{Column{"air_density_kg_m3", &StepMean::air_density_kg_m3},
           Column{"air_density_u_kg_m3", &StepMean::air_density_u_kg_m3}}},
    Group{{Column{"discarded_s", &StepMean::discarded_s}, Column{"thrust_n_eff", &StepMean::thrust_n_eff},
           Column{"thrust_u_n", &StepMean::thrust_u_n}, Column{"thrust_freedom", &StepMean::thrust_freedom},
           Column{"speed_u_rad_s", &StepMean::speed_u_rad_s}, Column{"zero_u_n", &StepMean::zero_u_n},
           Column{"zero_moved_n", &StepMean::zero_moved_n}, Column{"lag_s", &StepMean::lag_s},
           Column{"lag_u_s", &StepMean::lag_u_s}, Column{"speed_glitches", &StepMean::speed_glitches}}},
    Group{{Column{"repetitions_averaged", &StepMean::repetitions_averaged},
           Column{"repetitions_left_out", &StepMean::repetitions_left_out}}},
};

using Columns = std::vector<Column>;

Columns with_groups(const std::array<bool, kGroups.size()>& present) {
  Columns columns(kColumns.begin(), kColumns.end());
  for (std::size_t i = 0; i < kGroups.size(); ++i) {
    if (present[i]) columns.insert(columns.end(), kGroups[i].columns.begin(), kGroups[i].columns.end());
  }
  return columns;
}

Columns columns_of(std::span<const StepMean> steps) {
  std::array<bool, kGroups.size()> present{};
  for (std::size_t i = 0; i < kGroups.size(); ++i)
    present[i] = std::any_of(steps.begin(), steps.end(), [&](const StepMean& step) { return kGroups[i].in(step); });
  return with_groups(present);
}

std::string header_of(const Columns& columns) {
  std::string line;
  for (const Column& column : columns) line += (line.empty() ? "" : ",") + std::string(column.name);
  return line;
}

constexpr std::array kFlagNames{
    std::pair{QualityFlag::speed_not_reached, std::string_view("speed_not_reached")},
    std::pair{QualityFlag::speed_unsteady, std::string_view("speed_unsteady")},
    std::pair{QualityFlag::saturated, std::string_view("saturated")},
    std::pair{QualityFlag::lost_samples, std::string_view("lost_samples")},
    std::pair{QualityFlag::derated, std::string_view("derated")},
    std::pair{QualityFlag::few_samples, std::string_view("few_samples")},
    std::pair{QualityFlag::bad_status, std::string_view("bad_status")},
    std::pair{QualityFlag::stream_restarted, std::string_view("stream_restarted")},
    std::pair{QualityFlag::rebooted, std::string_view("rebooted")},
    std::pair{QualityFlag::stalled, std::string_view("stalled")},
    std::pair{QualityFlag::silent, std::string_view("silent")},
    std::pair{QualityFlag::box_trouble, std::string_view("box_trouble")},
    std::pair{QualityFlag::taken_over, std::string_view("taken_over")},
    std::pair{QualityFlag::configuration_changed, std::string_view("configuration_changed")},
    std::pair{QualityFlag::zero_drifted, std::string_view("zero_drifted")},
    std::pair{QualityFlag::zero_noisy, std::string_view("zero_noisy")},
    std::pair{QualityFlag::drive_saturated, std::string_view("drive_saturated")},
    std::pair{QualityFlag::motor_fault, std::string_view("motor_fault")},
    std::pair{QualityFlag::supply_out_of_band, std::string_view("supply_out_of_band")},
    std::pair{QualityFlag::coil_hot, std::string_view("coil_hot")},
    std::pair{QualityFlag::motor_reset, std::string_view("motor_reset")},
    std::pair{QualityFlag::motor_lost, std::string_view("motor_lost")},
    std::pair{QualityFlag::slow_round_trip, std::string_view("slow_round_trip")},
    std::pair{QualityFlag::supply_limited, std::string_view("supply_limited")},
    std::pair{QualityFlag::supply_off, std::string_view("supply_off")},
    std::pair{QualityFlag::supply_sag, std::string_view("supply_sag")},
    std::pair{QualityFlag::supply_rise, std::string_view("supply_rise")},
    std::pair{QualityFlag::unsettled, std::string_view("unsettled")},
    std::pair{QualityFlag::drifted, std::string_view("drifted")},
    std::pair{QualityFlag::lag_unknown, std::string_view("lag_unknown")},
    std::pair{QualityFlag::frozen, std::string_view("frozen")},
    std::pair{QualityFlag::speed_glitch, std::string_view("speed_glitch")},
};

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

struct Format {
  const StepMean& step;
  std::string operator()(std::string StepMean::*m) const { return quoted(step.*m); }
  std::string operator()(int StepMean::*m) const { return std::to_string(step.*m); }
  std::string operator()(std::uint64_t StepMean::*m) const { return std::to_string(step.*m); }
  std::string operator()(double StepMean::*m) const { return std::isnan(step.*m) ? std::string() : shortest(step.*m); }
  std::string operator()(Flags d) const { return quality_flag_names(step.*d.member); }
};

template <class Value>
Value required(std::optional<Value> value, const char* problem) {
  if (!value) throw std::invalid_argument(problem);
  return *value;
}

struct Parse {
  StepMean& step;
  const std::string& text;
  void operator()(std::string StepMean::*m) const { step.*m = text; }
  void operator()(int StepMean::*m) const { step.*m = required(parse_integer<int>(text), "is not a whole number"); }
  void operator()(std::uint64_t StepMean::*m) const {
    step.*m = required(parse_integer<std::uint64_t>(text), "is not a whole number");
  }
  void operator()(double StepMean::*m) const {
    step.*m = text.empty() ? kNotMeasured : required(parse_double(text), "is not a number");
  }
  void operator()(Flags d) const { step.*d.member = quality_flags_from_names(text); }
};

/// Fields of one record from `at` on, into those of the last; leaves `at` after its line end and counts the line feeds
/// passed.
void next_record(std::string_view text, std::size_t& at, std::size_t& lines, std::vector<std::string>& fields) {
  std::size_t n = 0;
  const auto open_field = [&] {
    if (n == fields.size()) fields.emplace_back();
    fields[n++].clear();
  };
  open_field();
  bool inside = false;
  while (at < text.size()) {
    // Plain text is copied in one piece.
    const std::size_t begin = at;
    while (at < text.size() && text[at] != '"' && text[at] != '\n' && (inside || text[at] != ',')) ++at;
    fields[n - 1].append(text.substr(begin, at - begin));
    if (at == text.size()) break;
    const char c = text[at++];
    if (c == ',') {
      open_field();
    } else if (c == '"') {
      const bool doubled = inside && at < text.size() && text[at] == '"';
      if (doubled) fields[n - 1] += text[at++];
      if (!doubled) inside = !inside;
    } else {
      ++lines;
      if (!inside) break;
      fields[n - 1] += c;
    }
  }
  fields.resize(n);
  if (inside) throw std::invalid_argument("a quoted field does not end");
  if (!fields.back().empty() && fields.back().back() == '\r') fields.back().pop_back();
}

std::string row_of(const StepMean& step, const Columns& columns) {
  std::string line;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (i > 0) line += ',';
    line += std::visit(Format{step}, columns[i].field);
  }
  return line;
}

/// The columns that a header names, in its order. All but those of the groups must be there, none twice.
Columns columns_named(const std::vector<std::string>& names) {
  Columns known(kColumns.begin(), kColumns.end());
  for (const Group& group : kGroups) known.insert(known.end(), group.columns.begin(), group.columns.end());
  Columns columns;
  for (const std::string& name : names) {
    const auto is_it = [&](const Column& column) { return column.name == name; };
    const auto found = std::find_if(known.begin(), known.end(), is_it);
    if (found == known.end()) throw std::invalid_argument(fmt::format("unknown column \"{}\"", name));
    if (std::any_of(columns.begin(), columns.end(), is_it))
      throw std::invalid_argument(fmt::format("column {} occurs twice", name));
    columns.push_back(*found);
  }
  for (const Column& required : kColumns) {
    const auto is_it = [&](const Column& column) { return std::string_view(column.name) == required.name; };
    if (std::none_of(columns.begin(), columns.end(), is_it))
      throw std::invalid_argument(fmt::format("column {} is missing; expected {}", required.name, steps_header()));
  }
  return columns;
}

StepMean step_from(const std::vector<std::string>& fields, const Columns& columns) {
  if (fields.size() != columns.size()) {
    throw std::invalid_argument(fmt::format("{} fields where the header has {}", fields.size(), columns.size()));
  }
  StepMean step;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    try {
      std::visit(Parse{step, fields[i]}, columns[i].field);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}: \"{}\" {}", columns[i].name, fields[i], error.what()));
    }
  }
  return step;
}

}  // namespace

std::string quality_flag_names(std::uint32_t flags) {
  std::string names;
  for (const auto& [bit, name] : kFlagNames) {
    if ((flags & static_cast<std::uint32_t>(bit)) == 0) continue;
    if (!names.empty()) names += '+';
    names += name;
  }
  return names;
}

std::uint32_t quality_flags_from_names(std::string_view names) {
  std::uint32_t flags = 0;
  while (!names.empty()) {
    const std::size_t plus = std::min(names.find('+'), names.size());
    const std::string_view word = names.substr(0, plus);
    std::uint32_t bit = 0;
    for (const auto& [value, name] : kFlagNames) {
      if (name == word) bit = static_cast<std::uint32_t>(value);
    }
    if (bit == 0) throw std::invalid_argument(fmt::format("unknown quality flag \"{}\"", word));
    flags |= bit;
    names.remove_prefix(std::min(plus + 1, names.size()));
  }
  return flags;
}

std::string steps_header() { return header_of(with_groups({})); }

std::string format_steps(std::span<const StepMean> steps) {
  const Columns columns = columns_of(steps);
  std::string text = header_of(columns) + '\n';
  for (const StepMean& step : steps) text += row_of(step, columns) + '\n';
  return text;
}

std::vector<StepMean> parse_steps(std::string_view text, const std::string& name) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::size_t at = 0;
  std::size_t lines = 0;
  std::size_t line = 1;
  std::vector<StepMean> steps;
  try {
    std::vector<std::string> fields;
    next_record(text, at, lines, fields);
    const Columns columns = columns_named(fields);
    while (at < text.size()) {
      line = lines + 1;
      const std::size_t begin = at;
      next_record(text, at, lines, fields);
      if (steps.empty()) steps.reserve(text.size() / (at - begin) + 1);
      steps.push_back(step_from(fields, columns));
    }
  } catch (const std::invalid_argument& error) {
    throw ConfigurationError(fmt::format("{}:{}: {}", name, line, error.what()));
  }
  return steps;
}

void write_steps(const std::filesystem::path& path, std::span<const StepMean> steps, FileLayer& files) {
  write_text(path, format_steps(steps), files);
}

std::vector<StepMean> read_steps(const std::filesystem::path& path) {
  return parse_steps(read_text(path), path.string());
}

}  // namespace kphi::results
