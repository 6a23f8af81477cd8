#include "results/steps_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>
#include <variant>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "base/number.hpp"
#include "base/ordered_work.hpp"
#include "base/text.hpp"

namespace kphi::results {
namespace {

using Field = std::variant<std::string StepMean::*, int StepMean::*, std::uint64_t StepMean::*, double StepMean::*,
                           std::uint32_t StepMean::*>;  // the last one: flags

struct StepColumn {
  const char* name;
  Field field;
  int group = 0;  ///< columns of a group but 0 are written if a step has a value for one of them
};

const std::array kColumns{
    // the step
    StepColumn{"propeller", &StepMean::propeller}, StepColumn{"blades", &StepMean::blades},
    StepColumn{"diameter_in", &StepMean::diameter_in}, StepColumn{"occlusion_deg", &StepMean::occlusion_deg},
    StepColumn{"repetition", &StepMean::repetition}, StepColumn{"step", &StepMean::step},
    StepColumn{"commanded_speed_rad_s", &StepMean::commanded_speed_rad_s},
    // what it measured
    StepColumn{"speed_rad_s", &StepMean::speed_rad_s}, StepColumn{"speed_sd_rad_s", &StepMean::speed_sd_rad_s},
    StepColumn{"speed_n", &StepMean::speed_n}, StepColumn{"thrust_n", &StepMean::thrust_n},
    StepColumn{"thrust_sd_n", &StepMean::thrust_sd_n}, StepColumn{"thrust_samples", &StepMean::thrust_samples},
    StepColumn{"torque_nm", &StepMean::torque_nm}, StepColumn{"torque_sd_nm", &StepMean::torque_sd_nm},
    StepColumn{"zero_n", &StepMean::zero_n}, StepColumn{"supply_voltage_v", &StepMean::supply_voltage_v},
    StepColumn{"supply_current_a", &StepMean::supply_current_a},
    StepColumn{"motor_current_a", &StepMean::motor_current_a},
    StepColumn{"coil_temperature_degc", &StepMean::coil_temperature_degc},
    StepColumn{"window_begin_s", &StepMean::window_begin_s}, StepColumn{"window_end_s", &StepMean::window_end_s},
    StepColumn{"quality_flags", &StepMean::quality_flags},
    // bench supply
    StepColumn{"supply_v", &StepMean::supply_v, 1}, StepColumn{"supply_a", &StepMean::supply_a, 1},
    StepColumn{"supply_w", &StepMean::supply_w, 1},
    // air
    StepColumn{"air_density_kg_m3", &StepMean::air_density_kg_m3, 2},
    StepColumn{"air_density_u_kg_m3", &StepMean::air_density_u_kg_m3, 2},
    // how certain it is
    StepColumn{"discarded_s", &StepMean::discarded_s, 3}, StepColumn{"thrust_n_eff", &StepMean::thrust_n_eff, 3},
    StepColumn{"thrust_u_n", &StepMean::thrust_u_n, 3}, StepColumn{"thrust_freedom", &StepMean::thrust_freedom, 3},
    StepColumn{"speed_u_rad_s", &StepMean::speed_u_rad_s, 3}, StepColumn{"zero_u_n", &StepMean::zero_u_n, 3},
    StepColumn{"zero_moved_n", &StepMean::zero_moved_n, 3}, StepColumn{"lag_s", &StepMean::lag_s, 3},
    StepColumn{"lag_u_s", &StepMean::lag_u_s, 3}, StepColumn{"speed_glitches", &StepMean::speed_glitches, 3},
    // averages
    StepColumn{"repetitions_averaged", &StepMean::repetitions_averaged, 4},
    StepColumn{"repetitions_left_out", &StepMean::repetitions_left_out, 4},
    StepColumn{"k_scatter_share", &StepMean::k_scatter_share, 4},
    StepColumn{"thrust_scatter_n", &StepMean::thrust_scatter_n, 4},
    // origin
    StepColumn{"simulated", &StepMean::simulated, 5}};

/// A table that another program wrote may lack it.
constexpr std::string_view kZeroColumn = "zero_n";

using Columns = std::vector<StepColumn>;

/// For each group whether one of the steps has a value for one of its columns.
using Groups = std::array<bool, 6>;
constexpr Groups kNoGroups{true};  // but the one of the columns that all have

void take_groups(const StepMean& step, Groups& groups) {
  for (const StepColumn& column : kColumns) {
    bool& has = groups[static_cast<std::size_t>(column.group)];
    if (column.group == 0 || has) continue;
    if (const auto* field = std::get_if<double StepMean::*>(&column.field)) has = !std::isnan(step.**field);
  }
}

Columns columns_of(const Groups& groups) {
  Columns columns;
  for (const StepColumn& column : kColumns)
    if (groups[static_cast<std::size_t>(column.group)]) columns.push_back(column);
  return columns;
}

std::string header_of(const Columns& columns) {
  std::string line;
  for (const StepColumn& column : columns) line += (line.empty() ? "" : ",") + std::string(column.name);
  return line;
}

/// A flag in a file and for a person.
struct FlagText {
  std::string_view name, words;
};
constexpr std::array<FlagText, 32> kFlagTexts{{
    // in the order of the bits
    {"speed_not_reached", "commanded speed not reached"},
    {"speed_unsteady", "speed never settled"},
    {"saturated", "load cell saturated"},
    {"lost_samples", "samples lost"},
    {"derated", "motor derated"},
    {"few_samples", "too few samples"},
    {"bad_status", "load cell reported an error"},
    {"stream_restarted", "stream restarted"},
    {"rebooted", "load cell's box rebooted since the zero"},
    {"stalled", "load cell repeated its measurement"},
    {"silent", "load cell fell silent"},
    {"box_trouble", "load cell's box reported failed communication"},
    {"taken_over", "another client took the stream"},
    {"configuration_changed", "load cell's box settings changed"},
    {"zero_drifted", "load cell's zero drifted during the run"},
    {"zero_noisy", "load cell was not at rest at a zero"},
    {"drive_saturated", "motor drive saturated"},
    {"motor_fault", "motor module reported a fault"},
    {"supply_out_of_band", "supply voltage off"},
    {"coil_hot", "motor coil hot"},
    {"motor_reset", "motor module restarted"},
    {"motor_lost", "motor module lost"},
    {"slow_round_trip", "motor readings blurred in time"},
    {"supply_limited", "supply limited the current"},
    {"supply_off", "supply was off"},
    {"supply_sag", "supply sagged"},
    {"supply_rise", "motor fed back into the supply"},
    {"unsettled", "thrust never settled"},
    {"drifted", "thrust drifted within the step"},
    {"lag_unknown", "lag of the thrust unknown"},
    {"frozen", "load cell or speed repeated one value"},
    {"speed_glitch", "impossible speeds skipped"},
}};

std::string joined(std::uint32_t flags, std::string_view FlagText::*text, const char* separator) {
  std::string all;
  for (std::size_t bit = 0; bit < kFlagTexts.size(); ++bit)
    if ((flags >> bit & 1u) != 0) all.append(all.empty() ? "" : separator).append(kFlagTexts[bit].*text);
  return all;
}

void append_quoted(std::string& line, const std::string& text) {
  if (text.find_first_of(",\" \t") == std::string::npos) {
    line += text;
    return;
  }
  line += '"';
  for (const char c : text) line.append(c == '"' ? 2 : 1, c);
  line += '"';
}

/// One column's fields. Most of a log repeat from row to row: those are written again, not formatted again.
class FieldText {
 public:
  explicit FieldText(const StepColumn& column) : field_(column.field) {}
  void append(const StepMean& step, std::string& line) {
    std::visit([&](auto member) { append_member(step.*member, line); }, field_);
  }

 private:
  void append_member(const std::string& text, std::string& line) { append_quoted(line, text); }
  void append_member(std::uint32_t flags, std::string& line) {
    if (flags != 0) line += quality_flag_names(flags);
  }
  void append_member(double value, std::string& line) {
    if (std::isnan(value)) return;
    const auto bits = std::bit_cast<std::uint64_t>(value);
    if (bits != bits_ || text_.empty()) {
      text_.clear();
      append_shortest(text_, value);
      bits_ = bits;
    }
    line += text_;
  }
  template <class Whole>
  void append_member(Whole value, std::string& line) {
    const fmt::format_int digits(value);
    line.append(digits.data(), digits.size());
  }

  Field field_;
  std::uint64_t bits_ = 0;
  std::string text_;  ///< of the double with these bits; empty before the first
};

template <class Value>
Value required(std::optional<Value> value, const char* problem) {
  if (!value) throw std::invalid_argument(problem);
  return *value;
}

struct Parse {
  StepMean& step;
  std::string_view text;
  void operator()(std::string StepMean::*m) const { step.*m = text; }
  void operator()(int StepMean::*m) const { step.*m = required(parse_integer<int>(text), "is not a whole number"); }
  void operator()(std::uint64_t StepMean::*m) const {
    step.*m = required(parse_integer<std::uint64_t>(text), "is not a whole number");
  }
  void operator()(double StepMean::*m) const {
    step.*m = text.empty() ? kNotMeasured : required(parse_double(text), "is not a number");
  }
  void operator()(std::uint32_t StepMean::*m) const { step.*m = quality_flags_from_names(text); }
};

void append_row(std::string& text, const StepMean& step, std::vector<FieldText>& fields) {
  for (FieldText& field : fields) {
    field.append(step, text);
    text += ',';
  }
  text.back() = '\n';
}

/// `work` on [begin, end) of `count` rows after the other; `take` gets what it gives, in order.
template <class Result, class Work>
void in_pieces(std::size_t count, const Work& work, const std::function<void(Result)>& take) {
  constexpr std::size_t kRows = 4096;
  OrderedWork<Result> pieces(take);
  for (std::size_t begin = 0; begin < count; begin += kRows)
    pieces.add(count > kRows ? std::launch::async : std::launch::deferred,
               [&work, begin, end = std::min(begin + kRows, count)] { return work(begin, end); });
  pieces.finish();
}

/// Hands the file over in pieces.
void format_to(const StepSource& steps, const std::function<void(std::string_view)>& sink) {
  Groups groups = kNoGroups;
  in_pieces<Groups>(
      steps.count,
      [&](std::size_t begin, std::size_t end) {
        Groups of_piece{};
        for (std::size_t i = begin; i < end; ++i) take_groups(steps.step(i), of_piece);
        return of_piece;
      },
      [&](const Groups& of_piece) { std::ranges::transform(groups, of_piece, groups.begin(), std::logical_or()); });
  const Columns columns = columns_of(groups);
  sink(header_of(columns) + '\n');
  in_pieces<std::string>(
      steps.count,
      [&](std::size_t begin, std::size_t end) {
        std::string text;
        std::vector<FieldText> fields(columns.begin(), columns.end());
        text.reserve((end - begin) * 128);
        for (std::size_t i = begin; i < end; ++i) append_row(text, steps.step(i), fields);
        return text;
      },
      sink);
}

/// The columns that a header names, in its order. All but those of the groups must be there, none twice.
Columns columns_named(const std::vector<std::string>& names) {
  Columns columns;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(kColumns, name, &StepColumn::name);
    if (found == kColumns.end()) throw std::invalid_argument(fmt::format("unknown column {}", in_quotes(name)));
    if (std::ranges::count(names, name) > 1) throw std::invalid_argument(fmt::format("column {} occurs twice", name));
    columns.push_back(*found);
  }
  for (const StepColumn& required : columns_of(kNoGroups)) {
    if (std::ranges::find(names, required.name) == names.end() && required.name != kZeroColumn)
      throw std::invalid_argument(
          fmt::format("column {} is missing; expected {}", required.name, header_of(columns_of(kNoGroups))));
  }
  return columns;
}

StepMean step_from(std::span<const std::string_view> fields, const Columns& columns) {
  StepMean step;
  step.zero_n = kNotMeasured;  // unless there is the column
  for (std::size_t i = 0; i < fields.size(); ++i) {
    try {
      std::visit(Parse{step, fields[i]}, columns[i].field);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}: {} {}", columns[i].name, in_quotes(fields[i]), error.what()));
    }
  }
  return step;
}

}  // namespace

std::string quality_flag_names(std::uint32_t flags) { return joined(flags, &FlagText::name, "+"); }

std::string quality_flags_in_words(std::uint32_t flags) { return joined(flags, &FlagText::words, ", "); }

void FlaggedSteps::add(std::uint32_t flags) noexcept {
  ++steps;
  flagged += flags != 0;
  for (std::size_t bit = 0; bit < by_bit.size(); ++bit) by_bit[bit] += static_cast<int>(flags >> bit & 1u);
}

std::string in_words(const FlaggedSteps& steps) {
  constexpr std::size_t kMost = 4;
  std::string words = fmt::format("{} of {} steps flagged", steps.flagged, steps.steps);
  if (steps.flagged == 0) return words;
  std::vector<std::size_t> bits;
  std::uint32_t all = 0;
  for (std::size_t bit = 0; bit < steps.by_bit.size(); ++bit) {
    if (steps.by_bit[bit] == 0) continue;
    bits.push_back(bit);
    all |= 1u << bit;
  }
  std::ranges::stable_sort(bits, std::greater<>(), [&](std::size_t bit) { return steps.by_bit[bit]; });
  std::vector<std::string> named;
  for (std::size_t i = 0; i < std::min(bits.size(), kMost); ++i)
    named.push_back(fmt::format("{} {}", kFlagTexts[bits[i]].words, steps.by_bit[bits[i]]));
  if (bits.size() > kMost) named.push_back(fmt::format("{} more", bits.size() - kMost));
  return words + fmt::format(" ({}{})", fmt::join(named, ", "), (all & ~kHarmlessFlags) == 0 ? "; none spoils k" : "");
}

std::map<std::string, int> flag_counts(const FlaggedSteps& steps) {
  std::map<std::string, int> counts;
  for (std::size_t bit = 0; bit < steps.by_bit.size(); ++bit)
    if (steps.by_bit[bit] > 0) counts[std::string(kFlagTexts[bit].name)] = steps.by_bit[bit];
  return counts;
}

std::uint32_t quality_flags_from_names(std::string_view names) {
  std::uint32_t flags = 0;
  while (!names.empty()) {
    const std::string_view word = names.substr(0, names.find('+'));
    const auto bit = std::ranges::find(kFlagTexts, word, &FlagText::name) - kFlagTexts.begin();
    if (bit == std::ssize(kFlagTexts))
      throw std::invalid_argument(fmt::format("unknown quality flag {}", in_quotes(word)));
    flags |= 1u << bit;
    names.remove_prefix(std::min(word.size() + 1, names.size()));
  }
  return flags;
}

std::string format_steps(std::span<const StepMean> steps) {
  std::string text;
  format_to({steps.size(), [&](std::size_t i) { return steps[i]; }}, [&](std::string_view piece) { text += piece; });
  return text;
}

std::vector<StepMean> parse_steps(std::string_view text, const std::string& name) {
  std::size_t line = 1;
  std::vector<StepMean> steps;
  steps.reserve(text.size() / 256);  // a row takes twice that
  std::optional<Columns> columns;
  const auto follow = [&](const Table& table) {
    // The reader of tables goes on without such a line; here it is a fault.
    for (const TableProblem& problem : table.problems) {
      line = problem.line;
      throw std::invalid_argument(problem.what.substr(0, problem.what.find(';')));
    }
    if (!columns) columns = columns_named(table.header);
  };
  try {
    follow(read_csv(text, name, ',', [&](const Table& table, const RowView& row) {
      follow(table);
      line = row.line;
      steps.push_back(step_from(row.fields, *columns));
    }));
  } catch (const std::invalid_argument& error) {
    throw ConfigurationError(fmt::format("{}:{}: {}", name, line, error.what()));
  }
  return steps;
}

void write_steps(const std::filesystem::path& path, std::span<const StepMean> steps, FileLayer& files) {
  write_text(path, format_steps(steps), files);
}

void write_steps(const std::filesystem::path& path, const StepSource& steps, FileLayer& files) {
  ReplacedFile file(path, files);
  format_to(steps, [&](std::string_view piece) { file.append(piece); });
  file.finish();
}

std::vector<StepMean> read_steps(const std::filesystem::path& path) {
  return parse_steps(read_text(path), path.string());
}

}  // namespace kphi::results
