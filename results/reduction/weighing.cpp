#include "results/reduction/weighing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "base/error.hpp"
#include "base/json.hpp"
#include "base/number.hpp"
#include "results/file_layer.hpp"
#include "results/reduction/bin_statistics.hpp"

namespace kphi::results {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFormat = "kphi-weighing/1";
constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr double kAirPerWeight = 1.2 / 8000;  // buoyancy of a conventional mass

using Axes = std::array<double, 6>;

/// A load without the zeros around it, and what the noise makes of it.
struct Load {
  Axes read{}, u{};
};

std::vector<Load> loads_of(const Weighing& weighing) {
  const auto& levels = weighing.levels;
  std::vector<Load> loads;
  for (std::size_t i = 1; i + 1 < levels.size(); i += 2) {
    const auto &before = levels[i - 1], &on = levels[i], &after = levels[i + 1];
    if (before.loaded || !on.loaded || after.loaded) throw std::invalid_argument("a load stands between two zeros");
    const double share = (on.time_s - before.time_s) / (after.time_s - before.time_s);
    Load load;
    for (std::size_t axis = 0; axis < 6; ++axis) {
      load.read[axis] = on.mean[axis] - ((1 - share) * before.mean[axis] + share * after.mean[axis]);
      load.u[axis] = std::hypot(on.u[axis], (1 - share) * before.u[axis], share * after.u[axis]);
    }
    loads.push_back(load);
  }
  if (loads.empty()) throw std::invalid_argument("nothing was weighed");
  return loads;
}

/// Mean of values that were found alike, each with the same `noise`: their scatter, and never less than the noise.
Weighed mean_of(const std::vector<double>& values, double noise) {
  const double n = static_cast<double>(values.size());
  Weighed mean{0, noise / std::sqrt(n), kEndless};
  for (const double value : values) mean.value += value / n;
  if (values.size() < 2) return mean;
  double squares = 0;
  for (const double value : values) squares += std::pow(value - mean.value, 2);
  mean.u = std::max(mean.u, std::sqrt(squares / (n - 1) / n));
  mean.freedom = n - 1;
  return mean;
}

/// The largest change of the zero across a load.
Weighed hysteresis_of(const Weighing& weighing, std::size_t axis, double load) {
  Weighed largest{0, 0, kEndless};
  for (std::size_t i = 0; i + 2 < weighing.levels.size(); i += 2) {
    const auto &before = weighing.levels[i], &after = weighing.levels[i + 2];
    const double change = (after.mean[axis] - before.mean[axis]) / load;
    if (i > 0 && std::abs(change) <= std::abs(largest.value)) continue;
    largest.value = change;
    largest.u = std::hypot(before.u[axis], after.u[axis]) / std::abs(load);
  }
  return largest;
}

template <class Value>
void require(bool holds, const char* key, const Value& value) {
  if (!holds) throw std::invalid_argument(fmt::format("{} is {}", key, value));
}

}  // namespace

double Weighing::force_n() const { return mass_kg * gravity_m_s2 * (1 - kAirPerWeight); }

double Weighed::expanded() const { return u * (std::isinf(freedom) ? 1.959964 : student_95(freedom)); }

double CellCheck::u_calibration() const { return std::hypot(gain.value - 1, gain.u); }

CellCheck check_of(const Weighing& weighing) {
  const std::vector<Load> loads = loads_of(weighing);
  const auto along = static_cast<std::size_t>(weighing.axis);
  const double force = weighing.force_n();
  CellCheck check;
  check.sign = loads.front().read[along] < 0 ? -1 : +1;
  double load = 0;
  std::vector<double> gains;
  for (const Load& one : loads) {
    gains.push_back(check.sign * one.read[along] / force);
    load += one.read[along] / static_cast<double>(loads.size());
  }
  const Weighed scatter = mean_of(gains, loads.front().u[along] / force);
  check.hysteresis = hysteresis_of(weighing, along, load);
  // What stays of a load shifts the next one by as much, at most.
  const double u_other = std::hypot(check.hysteresis.value / std::sqrt(3.0), weighing.mass_u_kg / weighing.mass_kg,
                                    weighing.gravity_u_m_s2 / weighing.gravity_m_s2);
  check.gain = {scatter.value, std::hypot(scatter.u, scatter.value * u_other),
                joint_freedom(scatter.u, scatter.freedom, scatter.value * u_other, kEndless)};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    if (axis == along) continue;
    std::vector<double> shares;
    for (const Load& one : loads) shares.push_back(one.read[axis] / one.read[along]);
    check.crosstalk[axis] = mean_of(shares, loads.front().u[axis] / std::abs(load));
  }
  check.tilt_rad =
      std::atan(std::hypot(check.crosstalk[(along + 1) % 3].value, check.crosstalk[(along + 2) % 3].value));
  return check;
}

std::string gain_words(const Weighing& weighing, const CellCheck& check) {
  const double percent = 100 * (check.gain.value - 1), within = 100 * check.gain.expanded();
  if (std::abs(percent) <= within)
    return fmt::format("reads right within {} % along {}", two_digits(within), "xyz"[weighing.axis]);
  const std::string words = plain_with_error(std::abs(percent), within);
  return fmt::format("reads {} % too {} along {}", words, percent < 0 ? "little" : "much", "xyz"[weighing.axis]);
}

std::string format_weighing(const Weighing& weighing) {
  ordered_json file{{"format", kFormat}};
  KPHI_JSON_MEMBERS(file, weighing, origin, bench, weighed_utc, cell_serial, tool_version, mass_kg, mass_u_kg,
                    gravity_m_s2, gravity_u_m_s2);
  file["axis"] = std::string(1, "xyz"[weighing.axis]);
  for (const Weighing::Level& level : weighing.levels) {
    ordered_json row;
    KPHI_JSON_MEMBERS(row, level, loaded, time_s, seconds, mean, u);
    file["levels"].push_back(row);
  }
  return file.dump(1) + "\n";
}

Weighing parse_weighing(const std::string& text, const std::string& name) {
  try {
    const ordered_json file = ordered_json::parse(text);
    require(file.at("format") == kFormat, "format", file.at("format").dump());
    Weighing weighing;
    const auto take = [&](const char* key, auto& into) { file.at(key).get_to(into); };
    take("bench", weighing.bench);
    take("weighed_utc", weighing.weighed_utc);
    take("cell_serial", weighing.cell_serial);
    take("tool_version", weighing.tool_version);
    weighing.origin = file.value("origin", "");
    take("mass_kg", weighing.mass_kg);
    take("mass_u_kg", weighing.mass_u_kg);
    take("gravity_m_s2", weighing.gravity_m_s2);
    take("gravity_u_m_s2", weighing.gravity_u_m_s2);
    const std::string axis = file.at("axis");
    require(axis == "x" || axis == "y" || axis == "z", "axis", axis);
    require(weighing.mass_kg > 0 && weighing.mass_kg < 1e4, "mass_kg", weighing.mass_kg);
    require(weighing.gravity_m_s2 > 1 && weighing.gravity_m_s2 < 100, "gravity_m_s2", weighing.gravity_m_s2);
    weighing.axis = axis[0] - 'x';
    for (const ordered_json& row : file.at("levels")) {
      Weighing::Level level;
      row.at("loaded").get_to(level.loaded);
      row.at("time_s").get_to(level.time_s);
      row.at("seconds").get_to(level.seconds);
      row.at("mean").get_to(level.mean);
      row.at("u").get_to(level.u);
      weighing.levels.push_back(level);
    }
    (void)loads_of(weighing);
    return weighing;
  } catch (const ordered_json::exception& error) {
    throw ConfigurationError(fmt::format("{}: not a weighing of kphi weigh: {}", name, error.what()));
  } catch (const std::invalid_argument& error) {
    throw ConfigurationError(fmt::format("{}: not a weighing of kphi weigh: {}", name, error.what()));
  }
}

std::optional<Weighing> nearest_weighing(const std::filesystem::path& folder,
                                         const std::function<bool(const Weighing&)>& counts, const std::string& utc) {
  std::optional<Weighing> before, after;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    if (!entry.path().filename().string().ends_with(kWeighingEnds)) continue;
    Weighing weighing = parse_weighing(read_text(entry.path()), entry.path().string());
    if (!counts(weighing)) continue;
    // ISO 8601 sorts as text.
    if (weighing.weighed_utc <= utc) {
      if (!before || before->weighed_utc < weighing.weighed_utc) before = std::move(weighing);
    } else if (!after || weighing.weighed_utc < after->weighed_utc) {
      after = std::move(weighing);
    }
  }
  return before ? before : after;
}

}  // namespace kphi::results
