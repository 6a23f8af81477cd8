// Campaigns of one propeller over time: a control chart of its stand, and whether one campaign, everything since one,
// or a slow drift is more than chance.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/propellers/family.hpp"

namespace kphi::fit {

/// What a chart follows. The stand is the factor common to every k of a campaign against the mean of all campaigns:
/// load cell, mounting, clock and air move it, an occlusion does not.
enum class Followed : std::uint8_t { stand, thrust_coefficient, slope };
inline constexpr std::array kFollowed{Followed::stand, Followed::thrust_coefficient, Followed::slope};
[[nodiscard]] const char* name_of(Followed quantity);  ///< "all k together", "K_T", "slope"

/// One campaign, in the air in which all are compared. The u hold the errors that are new in each campaign; what the
/// bench brings along every time (calibration, clock, instruments) moves no chart.
struct HistoryEntry {
  std::string name;  ///< folder
  std::string when;  ///< ISO 8601, UTC
  std::array<Estimate, kFollowed.size()> values;

  [[nodiscard]] const Estimate& of(Followed quantity) const { return values[static_cast<std::size_t>(quantity)]; }
};

enum class ChangeKind : std::uint8_t {
  one_off,  ///< one campaign stands apart from all others
  shift,    ///< all from one campaign on
  drift,    ///< from the first to the last, evenly over time
};

struct Change {
  ChangeKind kind{};
  std::size_t at = 0;  ///< index of the campaign, or of the first one after the shift
  double share = 0;    ///< of the centre; of a drift from the first to the last campaign
  double u_share = 0;  ///< standard
  double p = 1;        ///< that chance alone brings one this large anywhere in the history

  [[nodiscard]] bool names(std::size_t campaign) const;
};

struct Chart {
  Followed quantity{};
  Estimate centre;             ///< mean of all campaigns, weighted; without `change`
  double between = 0;          ///< scatter from campaign to campaign beyond their own u, standard, share of the centre
  double freedom = 0;          ///< degrees of freedom behind `between`
  std::vector<double> limits;  ///< half-width about the centre in which 99.7 % lie, one per campaign
  std::optional<Change> change;  ///< the best explanation, if chance is none (5 % over all charts of the history)
};

struct History {
  std::string propeller;
  Air air = Air::measured;
  std::vector<double> occlusions_deg;  ///< that every campaign measured
  std::vector<HistoryEntry> entries;   ///< by time
  std::vector<Chart> charts;

  [[nodiscard]] bool steady() const;  ///< no chart has a change
};

inline constexpr std::size_t kLeastHistory = 4;  ///< campaigns; fewer cannot tell a shift from scatter

/// Whether these are campaigns of one propeller.
[[nodiscard]] bool of_one_propeller(std::span<const Fitted> campaigns);

/// `names` and `when`: one for each campaign. Throws ConfigurationError if they are not of one propeller or fewer than
/// kLeastHistory.
[[nodiscard]] History history_of(std::span<const Fitted> campaigns, std::span<const std::string> names,
                                 std::span<const std::string> when);
/// From entries whose `stand` is already given; sorts them.
[[nodiscard]] std::vector<Chart> charts_of(std::vector<HistoryEntry>& entries);

/// Sentences, one for each change; one that says so if there is none.
[[nodiscard]] std::vector<std::string> findings_of(const History& history);
/// Date, values ± 95 %, marks; then the sentences.
[[nodiscard]] std::string history_text(const History& history);
[[nodiscard]] std::string history_json(const History& history);

}  // namespace kphi::fit
