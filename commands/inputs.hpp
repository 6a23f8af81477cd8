// What several verbs read and write: a fit's input, a fitted folder, the files of a flight, the live page, outputs.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compensation/file/coefficient_file.hpp"
#include "compensation/rotors.hpp"
#include "compensation/thrust_curve.hpp"
#include "daq/live/live_session.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/model/curve_fit.hpp"
#include "fit/uncertainty/analysis.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "profiles/vehicle.hpp"
#include "results/campaign_folder.hpp"
#include "results/step_mean.hpp"

namespace kphi::commands {

/// What is fitted, and what is known about where it comes from.
struct FitInput {
  std::vector<results::StepMean> steps;
  std::vector<fit::CurvePoint> table;  ///< instead of steps
  fit::Provenance provenance;
  std::optional<profiles::Campaign> measured_by{};  ///< of a campaign folder: what was asked of the stand
  profiles::BenchConfig bench{};                    ///< of a campaign folder: of which stand
  std::filesystem::path folder;                     ///< where the outputs go
  bool campaign = false;                            ///< `folder` is a campaign folder
  bool mounted_once = false;                        ///< one mounting for all repetitions of an occlusion
  double u_speed = 0;                        ///< of a log: relative, of all speeds together, by the steps they come in
  std::optional<double> u_calibration{};     ///< relative, of the load cell, by the weighing in provenance.cell_weighed
  std::optional<fit::RecordedFit> record{};  ///< of a campaign's runs at 0° beside a log: how they are fitted
};

/// From a campaign folder, a folder with a steps.csv, a steps.csv or a table of k. Throws ConfigurationError, naming
/// the next move, if there are neither steps nor coefficients.
[[nodiscard]] FitInput load_input(const std::string& path, const std::string& unit_of_k = {});

/// What a verb takes, of the kinds of files that kphi knows by their first bytes.
enum class InputKind : std::uint8_t { table, run, coefficients };
/// Throws ConfigurationError, with the command that takes it, if `path` is a file of another kind that it knows.
void refuse_other_input(const std::string& path, InputKind wanted);

/// What the campaign's own files know of errors: the clock's from the bench file, the air's from its instruments, the
/// load cell's from a weighing of its bench beside it.
[[nodiscard]] fit::AnalysisOptions analysis_options(const FitInput& input, const fit::Identification& identification);

/// A log: steps without occlusion, as `kphi fit` fits them; `range` instead of the usual one, or the record's.
[[nodiscard]] fit::Fitted fitted_log(const FitInput& input, const std::optional<fit::SpeedRange>& range = {});

/// A folder with steps and coefficients, fitted and judged again as its coefficients.yaml says.
struct FittedFolder {
  FitInput input;
  fit::Fitted fitted;
};
[[nodiscard]] FittedFolder fitted_again(const std::string& folder);

/// The coefficient file of a folder, or the file itself. Throws ConfigurationError if it does not exist.
[[nodiscard]] std::filesystem::path coefficient_file_of(const std::string& path);

/// `--coefficients` and `--vehicle`, both required.
void add_flight_files(CLI::App& command, std::vector<std::string>& coefficients, std::string& vehicle);
/// As compensation::load_coefficients. Throws DataRejected if the file was changed since it was written.
[[nodiscard]] compensation::Coefficients load_sealed_coefficients(const std::string& path,
                                                                  compensation::Need need = compensation::Need::curve);
/// As load_sealed_coefficients. Throws DataRejected, too, if they lie in a campaign folder that is not as kphi left it,
/// or were fitted from other runs.
[[nodiscard]] compensation::Coefficients load_standing_coefficients(
    const std::string& path, compensation::Need need = compensation::Need::curve);
/// A line for each run behind them that the journal does not have so.
[[nodiscard]] std::vector<std::string> unlike_journal(const compensation::Coefficients& file,
                                                      const results::CampaignState& state);
/// Says on stderr, one line each: that they were not measured, that they are not fit to fly, by how much the thrust may
/// be wrong where the vehicle flies, if there is one, and what of them is unlike any propeller or stand. Returns
/// whether to fly on them, there or anywhere; nullopt: the file does not tell.
std::optional<fit::Readiness> print_standing(const compensation::Coefficients& file,
                                             const profiles::Vehicle* vehicle = nullptr);
/// The last of these alone.
void print_doubts(const std::string& path, const std::vector<std::string>& doubts);

/// The curves of the vehicle's four rotors, from one coefficient file for all or one for each. Throws
/// ConfigurationError for another number of files, or if a file and the vehicle measure φ differently.
[[nodiscard]] compensation::Rotors<compensation::ThrustCurve> load_curves_for(
    const std::vector<std::string>& coefficients, const profiles::Vehicle& vehicle);

/// Adds `--live [PORT]` and `--udp-json HOST:PORT`; `options` must outlive the command.
void add_live_options(CLI::App& command, daq::live::LiveOptions& options);
/// "live: http://…" as a line; empty without one.
[[nodiscard]] std::string live_greeting(const daq::live::LiveSession& view);

}  // namespace kphi::commands
