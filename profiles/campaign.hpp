// The campaign file: propeller × occlusions × repetitions of one step profile.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compensation/units.hpp"
#include "profiles/limits.hpp"

namespace kphi::profiles {

/// The order of a campaign's runs.
enum class RunOrderKind : std::uint8_t { listed, shuffled };
/// From first_rpm to last_rpm; from last to first; at random; from first to last and back, the turning point held once.
enum class StepOrderKind : std::uint8_t { up, down, shuffled, up_and_down };

struct Order {
  RunOrderKind runs = RunOrderKind::listed;
  StepOrderKind steps = StepOrderKind::up;
  std::uint64_t seed = 0;                ///< of the shuffling
  bool remount_each_repetition = false;  ///< the occlusion is taken off and mounted again for each run
  bool reference = false;                ///< the session begins and ends with a run without occlusion
};

/// "runs shuffled (seed 7), steps up_and_down, remounted for each repetition, reference runs first and last".
[[nodiscard]] std::string to_words(const Order& order);

/// One physical propeller. `id` is short and goes into file names ("5x3").
struct Propeller {
  std::string id;
  std::string name;
  double diameter_in = 0;
  int blades = 0;
};

/// A step ends before its time once it has settled and its mean is certain enough, a run leaves out steps that its k
/// does not need (RunCertainty), and an occlusion is run again while that would move its k.
struct Until {
  double k_share = 0;   ///< half of the 95 % interval of the k of a run, and of how far another run would move it
  Seconds dwell_least;  ///< no step ends before
  bool operator==(const Until&) const = default;
};

/// Commanded speeds of one run, held `dwell` each, with `until` at most so long. The levels are evenly spaced and
/// include both ends.
struct StepProfile {
  int steps = 0;
  Seconds dwell;
  RadPerSec first;
  RadPerSec last;
  std::optional<Until> until{};         ///< nullopt: every step is held to its end
  std::optional<double> slew_rad_s2{};  ///< limit of the commanded acceleration; nullopt: steps
  /// All levels, ascending or descending, `steps` of them.
  [[nodiscard]] std::vector<RadPerSec> levels() const;
};

/// The shortest time that a step is held.
[[nodiscard]] inline Seconds shortest_dwell(const StepProfile& profile) {
  return profile.until ? profile.until->dwell_least : profile.dwell;
}

struct Campaign {
  std::string name;
  std::string operator_name;  ///< may be empty
  Propeller propeller;
  std::vector<double> occlusions_deg;        ///< degrees in [0, 360), each once, as listed
  int repetitions = 3;                       ///< at least
  std::optional<int> repetitions_most = {};  ///< with profile.until; nullopt: as many as at least
  int repetitions_extra_max = 1;             ///< more runs of an occlusion, if repetitions disagree or by the range
  Order order;
  StepProfile profile;
  Seconds zero;             ///< motor off, before and after each run
  bool box_bias = false;    ///< the box is tared before each run; the load is measured for `zero` before and after
  Seconds minimum_discard;  ///< at the start of every step, not averaged
  Limits limits;
  Volts supply;
  std::string text;  ///< the file, verbatim
  std::string path;
};

/// Strict: refuses duplicate and unknown keys, wrong units and types. Throws ConfigurationError with file:line:column.
[[nodiscard]] Campaign load_campaign(const std::string& path);
/// As load_campaign, from text; `path` only names it in messages.
[[nodiscard]] Campaign parse_campaign(const std::string& text, const std::string& path);
/// What is allowed and rarely meant, a line each with the next move: degrees that look like radians, no occlusion of
/// 0°, one occlusion alone.
[[nodiscard]] std::vector<std::string> doubts_of(const Campaign& campaign);

}  // namespace kphi::profiles
