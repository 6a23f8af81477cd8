#include "commands/compensate.hpp"

#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/csv.hpp"
#include "base/number.hpp"
#include "base/text.hpp"
#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "profiles/vehicle_drawing.hpp"

namespace kphi::commands {
namespace {

using namespace compensation;

constexpr std::size_t kFlushAt = 1 << 16;

/// The columns that are read: of the shape, then of the thrusts.
std::vector<std::string> columns_in(std::size_t rotors, RowShape shape) {
  std::vector<std::string> names;
  for (std::size_t i = 1; i <= rotors; ++i) {
    if (shape == RowShape::arms) names.push_back(fmt::format("theta{}_deg", i));
    if (shape == RowShape::hubs) names.insert(names.end(), {fmt::format("hub{}_x_m", i), fmt::format("hub{}_y_m", i)});
  }
  for (std::size_t i = 1; i <= rotors; ++i) names.push_back(fmt::format("thrust{}_n", i));
  return names;
}

std::string header_out(std::size_t rotors) {
  std::string header;
  for (const auto& [before, after] : {std::pair{"phi", "_deg"}, {"k", ""}, {"speed", "_rpm"}}) {
    for (std::size_t i = 1; i <= rotors; ++i) header += fmt::format("{}{}{},", before, i, after);
  }
  return header + "flags\n";
}

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
                                   {Flag::at_ceiling, "at_ceiling"},
                                   {Flag::arm_angle_beyond, "arm_angle_beyond"},
                                   {Flag::arm_angle_stale, "arm_angle_stale"}};

using Fields = std::vector<std::string>;

/// Empty if the quotes of the line do not close.
Fields fields_of(std::string_view line) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (line.starts_with(kByteOrderMark)) line.remove_prefix(kByteOrderMark.size());
  if (line.ends_with('\r')) line.remove_suffix(1);
  return split_csv_line(line).value_or(Fields());
}

bool is_blank(const Fields& fields) { return fields == Fields{""}; }

/// Ends a complaint about the header.
std::string next_move_for(const std::vector<std::string>& columns) {
  const auto last_of_shape = columns[std::ranges::find(columns, "thrust1_n") - columns.begin() - 1];
  return fmt::format("; the first line must name {}..{} and thrust1_n..{} once each, separated by commas",
                     columns.front(), last_of_shape, columns.back());
}

/// What is wrong with a column that stands there `found` times; `names` may hold it in another unit.
std::string complaint_about(std::string_view wanted, std::ptrdiff_t found, const Fields& names,
                            const std::string& next_move) {
  if (found > 1) return fmt::format("column `{}` appears {} times{}", wanted, found, next_move);
  const std::string_view stem = wanted.substr(0, wanted.rfind('_') + 1);
  const auto like = std::ranges::find_if(names, [&](const std::string& name) { return name.starts_with(stem); });
  if (like == names.end()) return fmt::format("column `{}` is missing{}", wanted, next_move);
  return fmt::format("column `{}` is missing, but there is {}; convert it to the unit in the wanted name and rename it",
                     wanted, in_quotes(*like));
}

/// The places of the columns.
std::vector<std::size_t> read_header(const Fields& names, const std::vector<std::string>& columns) {
  const auto refuse = [](const std::string& what) { throw ConfigurationError("stdin:1: " + what); };
  const std::string next_move = next_move_for(columns);
  if (is_blank(names)) refuse(fmt::format("no header{}", next_move));
  std::vector<std::size_t> places;
  for (const std::string& column : columns) {
    const auto found = std::ranges::count(names, column);
    if (found != 1) refuse(complaint_about(column, found, names, next_move));
    places.push_back(static_cast<std::size_t>(std::ranges::find(names, column) - names.begin()));
  }
  return places;
}

/// Empty when the row can be used, else why not.
std::string read_row(const Fields& fields, std::size_t expected, const std::vector<std::string>& columns,
                     const std::vector<std::size_t>& places, std::vector<double>& values) {
  if (fields.empty()) return "has a quote that is not closed";
  if (fields.size() != expected) return fmt::format("has {} fields where the header has {}", fields.size(), expected);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto value = parse_finite(fields[places[i]]);
    if (!value) return fmt::format("{} is {}, not a finite number", columns[i], in_quotes(fields[places[i]]));
    values[i] = *value;
  }
  return {};
}

struct RowStyle {
  const char* before[4];  ///< every φ, every k_i, every speed, the flags
  const char* quote;      ///< around a flag
  const char* between;    ///< two flags
  const char* end;
};
constexpr RowStyle kCsv{{"", ",", ",", ","}, "", " ", "\n"};
constexpr RowStyle kJson{{"{\"phi_deg\":[", "],\"k\":[", "],\"speed_rpm\":[", "],\"flags\":["}, "\"", ",", "]}\n"};

void append_row(std::string& text, const RowStyle& style, const Compensator& compensator, const SpeedCommand& command) {
  const auto each = [&](std::size_t group, const auto& value_of) {
    text += style.before[group];
    for (std::size_t i = 0; i < compensator.rotors(); ++i) {
      if (i != 0) text += ',';
      text += shortest(value_of(i));
    }
  };
  each(0, [&](std::size_t i) { return to_degrees(compensator.occlusion_angles()[i]); });
  each(1, [&](std::size_t i) { return compensator.scaling_factors()[i]; });
  each(2, [&](std::size_t i) { return to_rpm(command.speeds[i]); });
  text += style.before[3];
  const char* separator = "";
  for (std::size_t i = 0; i < compensator.rotors(); ++i) {
    if (!command.flags[i].any()) continue;
    for (const FlagName& entry : kFlagNames) {
      if (!command.flags[i].has(entry.flag)) continue;
      text += separator + (style.quote + std::to_string(i + 1)) + ":" + std::string(entry.name) + style.quote;
      separator = style.between;
    }
  }
  text += style.end;
}

void set_shape(Compensator& compensator, RowShape shape, const std::vector<double>& values) {
  const std::size_t rotors = compensator.rotors();
  Rotors<Radians> angles(rotors);
  Rotors<HubPosition> hubs(rotors);
  for (std::size_t i = 0; i < rotors; ++i) {
    if (shape == RowShape::arms) angles[i] = from_degrees(values[i]);
    if (shape == RowShape::hubs) hubs[i] = {Metres(values[2 * i]), Metres(values[2 * i + 1])};
  }
  shape == RowShape::arms ? compensator.set_arms(angles) : compensator.set_hubs(hubs);
}

void hand_on(std::string& buffer, std::ostream& out) {
  out << buffer << std::flush;
  buffer.clear();
}

// ---- the verb

struct CompensateRequest {
  std::vector<std::string> coefficients;
  std::string vehicle;
  std::string law = "clamped";
  bool json = false;
};

Compensator compensator_of(const CompensateRequest& request, const profiles::Vehicle& vehicle) {
  const Rotors<ThrustCurve> curves = load_curves_for(request.coefficients, vehicle);
  const ScalingLaw law = request.law == "published" ? ScalingLaw::published : ScalingLaw::clamped;
  const BuildOutcome outcome = Compensator::build(curves, profiles::airframe_of(vehicle), law);
  if (!outcome.compensator) throw ConfigurationError(request.vehicle + ": " + describe(outcome.refusal));
  std::set<std::string> told;
  for (std::size_t i = 0; i < request.coefficients.size(); ++i) {
    const std::string& file = request.coefficients[i];
    if (!told.insert(file).second) continue;
    const CurveDoubts doubts = doubts_about(curves[i], law);
    if (doubts.gains_with_occlusion)
      std::cerr << file << ": k(φ) does not fall with the occlusion; check that this is the right file\n";
    if (doubts.steps_at_contact)
      std::cerr << file << ": k(φ) misses K_T at 0°, so the speeds step at first contact; "
                << "`kphi fit --anchored` avoids this\n";
  }
  return *outcome.compensator;
}

/// Reports rows that were skipped or out of reach; returns the exit code.
ExitCode verdict(const RowCounts& counts, const profiles::Vehicle& vehicle) {
  if (!std::cout) {
    std::cerr << "cannot write to standard output; " << counts.written << " rows were computed\n";
    return ExitCode::failure;
  }
  if (counts.out_of_reach > 0 && !vehicle.hubs.empty()) {
    std::cerr << counts.out_of_reach << " of " << counts.written
              << " rows have a hub more than 100 m away; there φ stays as it was before, as in flight "
                 "(arm_angle_beyond)\n";
  } else if (counts.out_of_reach > 0) {
    std::cerr << counts.out_of_reach << " of " << counts.written << " rows have an arm angle outside "
              << std::round(to_degrees(vehicle.arm_angle_min)) << " to "
              << std::round(to_degrees(vehicle.arm_angle_max)) << "°, the range of the servos of " << vehicle.path
              << "; there φ stays as it was before, as in flight (arm_angle_beyond)\n";
  }
  if (counts.rejected == 0) return ExitCode::ok;
  std::cerr << counts.rejected << " of " << counts.rejected + counts.written << " rows were skipped\n";
  return ExitCode::data_rejected;
}

ExitCode compensate(const CompensateRequest& request) {
  std::ios::sync_with_stdio(false);
  std::cin.tie(nullptr);
  const profiles::Vehicle vehicle = profiles::load_vehicle(request.vehicle);
  Compensator compensator = compensator_of(request, vehicle);
  if (isatty(STDERR_FILENO) != 0)
    std::cerr << fmt::format("{}\n", fmt::join(profiles::shapes_in_characters(vehicle), "\n"));
  if (isatty(STDIN_FILENO) != 0) std::cerr << "reading CSV from the keyboard; Ctrl-D ends the input\n";
  const RowCounts counts = compensate_rows(std::cin, std::cout, std::cerr, compensator,
                                           request.json ? RowFormat::json_lines : RowFormat::csv,
                                           vehicle.hubs.empty() ? RowShape::arms : RowShape::hubs);
  return verdict(counts, vehicle);
}

}  // namespace

RowCounts compensate_rows(std::istream& in, std::ostream& out, std::ostream& words, Compensator& compensator,
                          RowFormat format, RowShape shape) {
  const std::size_t rotors = compensator.rotors();
  const std::vector<std::string> columns = columns_in(rotors, shape);
  std::string line;
  std::uint64_t line_number = 1;
  const auto next = [&] {
    try {
      return next_line(in, line);
    } catch (const std::runtime_error& error) {
      throw ConfigurationError(fmt::format("stdin:{}: {}", line_number, error.what()));
    }
  };
  (void)next();
  const Fields header = fields_of(line);
  const auto places = read_header(header, columns);

  RowCounts counts;
  std::string buffer(format == RowFormat::csv ? header_out(rotors) : "");
  std::vector<double> values(columns.size());
  Rotors<Newtons> thrusts(rotors);
  while (out && (++line_number, next())) {
    const Fields fields = fields_of(line);
    if (is_blank(fields)) continue;
    const std::string complaint = read_row(fields, header.size(), columns, places, values);
    if (!complaint.empty()) {
      ++counts.rejected;
      words << "stdin:" << line_number << ": " << complaint << "; row skipped\n";
      continue;
    }
    set_shape(compensator, shape, values);
    for (std::size_t i = 0; i < rotors; ++i) thrusts[i] = Newtons(values[values.size() - rotors + i]);
    const auto beyond = [](Flags flags) { return flags.has(Flag::arm_angle_beyond); };
    if (std::ranges::any_of(compensator.arm_flags(), beyond)) ++counts.out_of_reach;
    const SpeedCommand command = compensator.speeds_for(thrusts);
    ++counts.written;
    append_row(buffer, format == RowFormat::csv ? kCsv : kJson, compensator, command);
    if (buffer.size() >= kFlushAt || in.rdbuf()->in_avail() <= 0) hand_on(buffer, out);
  }
  hand_on(buffer, out);
  return counts;
}

void add_compensate(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<CompensateRequest>(
      program, exit_code, "compensate",
      "turn rows of arm angles and thrusts (CSV on stdin) into occlusions, k_i and rotor speeds",
      "kphi compensate --coefficients coefficients.yaml --vehicle vehicle.yaml < demands.csv", compensate);
  add_notes(
      command,
      "Columns in, for each rotor: theta1_deg …, or hub1_x_m, hub1_y_m … of a vehicle with shapes_m, and thrust1_n …,\n"
      "in any order; others are ignored.\n"
      "Columns out: phi1_deg …, k1 … (k_i of equation 4), speed1_rpm …, flags (rotor:what, separated by blanks).\n"
      "A row that cannot be used is skipped and reported on stderr; the exit code is then 5.");
  add_flight_files(command, request.coefficients, request.vehicle);
  command
      .add_option("--law", request.law,
                  "how k(φ) becomes k_i: clamped to [0.1, 1], or published (equation 4 to the letter)")
      ->check(CLI::IsMember({"clamped", "published"}))
      ->capture_default_str();
  command.add_flag("--json", request.json, "print one JSON object per row instead of CSV");
}

}  // namespace kphi::commands
