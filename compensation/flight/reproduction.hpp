// Cell by cell beside the paper's Tables I to III: one set of flights without any error of assembly, as much lost in
// flight as on the bench (γ = 1) and as much more as the world says, and the spread over the draws.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compensation/flight/pilot.hpp"
#include "compensation/flight/study.hpp"
#include "compensation/flight/tables.hpp"

namespace kphi::flight {

enum class Reproduced : std::uint8_t { unknown, within, better, not_reproduced };

/// One number of the paper, and ours.
struct PaperCell {
  std::string row;   ///< "Table I  X -> O n.c."
  std::string what;  ///< "|x| [m]"
  double paper = 0;
  std::optional<double> bench;                  ///< γ = 1; nothing: lost, or not flown
  std::optional<double> world;                  ///< with the world's γ
  std::size_t draws = 0;                        ///< in which this leg was flown to its end
  Percentiles spread{};                         ///< over them
  Reproduced reproduced = Reproduced::unknown;  ///< unknown without draws
  Reason reason = Reason::in_x;                 ///< why not, where it is not
};

/// `within`: the paper's number lies between p10 and p90. Otherwise `not_reproduced`, unless it is an error in O and
/// ours is smaller: `better`. In X a smaller error counts for nothing, because the real drone's own errors are not
/// modelled.
[[nodiscard]] std::vector<PaperCell> paper_cells(const NineFlights& bench, const NineFlights& world,
                                                 const std::vector<Draw>& draws, const Gains& gains);

[[nodiscard]] constexpr const char* name_of(Reproduced reproduced) noexcept {
  return reproduced == Reproduced::within           ? "within"
         : reproduced == Reproduced::better         ? "better"
         : reproduced == Reproduced::not_reproduced ? "not reproduced"
                                                    : "";
}

[[nodiscard]] std::string reproduction_table(const std::vector<PaperCell>& cells, double gamma);

/// Of these cells, each once, in the order of kReasons: of those that are not reproduced, or, where nothing was drawn,
/// of all.
[[nodiscard]] std::vector<Reason> reasons_of(const std::vector<PaperCell>& cells);
/// "Not reproduced:" and the reasons under the letters of the table; empty if there are none.
[[nodiscard]] std::string not_reproduced(const std::vector<PaperCell>& cells);

/// What a millimetre does: the ratios with the centre of gravity off by (±1, ±0.5) mm and not at all.
struct CogSign {
  Eigen::Vector2d cog_error;  ///< m
  double hover_xy_plain, hover_xy_ratio, forward_ratio;
};
[[nodiscard]] std::vector<CogSign> signs_of_cog(const Scene& nominal, const Shadow& shadow);
[[nodiscard]] std::string cog_table(const std::vector<CogSign>& signs);

}  // namespace kphi::flight
