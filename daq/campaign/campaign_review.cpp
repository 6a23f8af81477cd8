#include "daq/campaign/campaign_review.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/json.hpp"
#include "results/digest.hpp"
#include "results/reduction/next_run.hpp"
#include "results/reduction/reference_drift.hpp"
#include "results/reduction/step_averages.hpp"
#include "results/reduction/two_ways.hpp"
#include "results/steps_csv.hpp"

namespace kphi::daq {
namespace {

using nlohmann::json;
using results::StepMean;

/// NaN becomes null.
json to_json(const results::RepetitionVerdict& verdict) {
  json list = json::array();
  for (const results::RepetitionFigure& figure : verdict.repetitions) {
    json& one = list.emplace_back(json{{"k_n_s2_per_rad2", figure.k}, {"u_k", figure.u}});
    KPHI_JSON_MEMBERS(one, figure, repetition, usable, outlying, p);
  }
  json all{{"repetitions", list}, {"k_n_s2_per_rad2", verdict.k}};
  KPHI_JSON_MEMBERS(all, verdict, occlusion_deg, between_sd, within_u, f, p, reason);
  return all;
}

json to_json(const results::Hysteresis& hysteresis) {
  json speeds = json::array();
  for (const results::HysteresisPoint& point : hysteresis.speeds)
    speeds.push_back(
        {{"speed_rad_s", point.speed_rad_s}, {"up_minus_down_n", point.up_minus_down_n}, {"u_n", point.u_n}});
  return {{"share_of_k", hysteresis.share}, {"u_share_of_k", hysteresis.u_share}, {"speeds", speeds}};
}

std::string to_words(const results::RepetitionVerdict& verdict) {
  std::string words = fmt::format("{:g}°: ", verdict.occlusion_deg);
  words += verdict.reason.empty() ? "repetitions agree: " : verdict.reason + "; ";
  if (std::isnan(verdict.between_sd)) return words + "nothing to compare it with";
  const auto known = std::ranges::count_if(
      verdict.repetitions, [](const results::RepetitionFigure& figure) { return !std::isnan(figure.k); });
  return words + fmt::format("k scatters by {:.3f} % over {} repetitions, noise alone gives {:.3f} %",
                             100 * verdict.between_sd / std::abs(verdict.k), known,
                             100 * verdict.within_u / std::abs(verdict.k));
}

}  // namespace

void CampaignReview::restore(const std::vector<StepMean>& means) {
  if (means.empty()) return;
  const bool is_reference = means.front().repetition < 0;
  auto& rows = is_reference ? references_ : steps_;
  rows.insert(rows.end(), means.begin(), means.end());
  sort();
  if (!is_reference) ++repetitions_[means.front().occlusion_deg];
  (void)cap_.learn(means);
}

void CampaignReview::add(const std::string& run, const std::vector<StepMean>& means) {
  SpeedCap before = cap_;
  restore(means);
  if (const auto lesson = before.learn(means)) {
    progress_.say(
        fmt::format("motor: full drive gives {:.0f} of {:.0f} RPM; later runs of {} skip the steps above {:.0f} RPM",
                    to_rpm(lesson->reached), to_rpm(lesson->commanded), campaign_.propeller.id, to_rpm(lesson->cap)));
    note_("speed_cap", {{"run", run},
                        {"commanded_rad_s", lesson->commanded.value()},
                        {"reached_rad_s", lesson->reached.value()},
                        {"cap_rad_s", lesson->cap.value()}});
  }
  if (campaign_.order.steps != profiles::StepOrderKind::up_and_down) return;
  const auto hysteresis = hysteresis_of(means);
  if (!hysteresis) return;
  progress_.say(fmt::format("{}: {}", run, hysteresis->to_words()));
  json data = to_json(*hysteresis);
  data["run"] = run;
  note_("hysteresis", data);
}

/// As replay finds the runs: occlusions as listed, then repetitions; within a run as measured.
void CampaignReview::sort() {
  const auto& listed = campaign_.occlusions_deg;
  const auto key = [&](const StepMean& step) {
    const auto place = std::ranges::find(listed, step.occlusion_deg) - listed.begin();
    return std::tuple(place, step.occlusion_deg, std::abs(step.repetition));
  };
  const auto by_key = [&](const StepMean& a, const StepMean& b) { return key(a) < key(b); };
  std::ranges::stable_sort(steps_, by_key);
  std::ranges::stable_sort(references_, by_key);
}

void CampaignReview::write(const results::CampaignFolder& folder, results::FileLayer& files) {
  json digests;
  const auto write = [&](const std::filesystem::path& table, std::span<const StepMean> steps) {
    results::write_steps(table, steps, files);
    digests[table.filename().string()] = results::sha256_of_file(table);
  };
  write(folder.steps(), steps_);
  write(folder.means(), means_of(steps_));
  if (!references_.empty()) write(folder.references(), references_);
  note_(results::kTablesWritten, {{"files", digests}});
}

int CampaignReview::repetitions(double occlusion_deg) const {
  const auto found = repetitions_.find(occlusion_deg);
  return found == repetitions_.end() ? 0 : found->second;
}

std::string CampaignReview::k_words(double occlusion_deg, int repetition) const {
  for (const results::RepetitionVerdict& verdict : results::judge_repetitions(steps_)) {
    for (const results::RepetitionFigure& figure : verdict.repetitions)
      if (verdict.occlusion_deg == occlusion_deg && figure.repetition == repetition && std::isfinite(figure.k))
        return fmt::format("k {:.4e} N/(rad/s)², ", figure.k);
  }
  return "";
}

std::optional<AnotherRun> CampaignReview::another(double occlusion_deg) {
  const int made = repetitions(occlusion_deg);
  if (made < campaign_.repetitions) return std::nullopt;
  results::RepetitionRule rule;
  rule.wanted = campaign_.repetitions;
  rule.at_most = campaign_.repetitions + campaign_.repetitions_extra_max;
  const auto verdicts = judge_repetitions(steps_, rule);
  const results::RepetitionVerdict verdict =
      *std::ranges::find_if(verdicts, [&](const auto& one) { return one.occlusion_deg == occlusion_deg; });
  if (made > 1 || !verdict.reason.empty()) {
    progress_.say(to_words(verdict));
    note_("repetitions_judged", to_json(verdict));
  }
  if (campaign_.repetitions_most) return while_it_moves_k(verdicts, occlusion_deg, made);
  if (!verdict.asks_for_another) return std::nullopt;
  return AnotherRun{occlusion_deg, verdict.reason, made - campaign_.repetitions + 1, campaign_.repetitions_extra_max,
                    campaign_.order.remount_each_repetition};
}

std::optional<AnotherRun> CampaignReview::while_it_moves_k(std::span<const results::RepetitionVerdict> verdicts,
                                                           double occlusion_deg, int made) const {
  const double most = campaign_.profile.until->k_share, moved = moved_by_next_run(verdicts, occlusion_deg);
  const std::string words = std::isfinite(moved)
                                ? fmt::format("another run would move k by up to {:.2f} %", 100 * moved)
                                : "k is not known yet";
  const bool enough = moved <= most, last = made >= *campaign_.repetitions_most;
  progress_.say(
      fmt::format("{:g}°: {}, {:g} % is enough{}", occlusion_deg, words, 100 * most,
                  enough ? ""
                  : last ? fmt::format("; not run again: {} runs are the most", made)
                         : fmt::format(": running it again, {} of at most {}", made + 1, *campaign_.repetitions_most)));
  if (enough || last) return std::nullopt;
  return AnotherRun{occlusion_deg,
                    words,
                    made - campaign_.repetitions + 1,
                    campaign_.repetitions_extra_max,
                    campaign_.order.remount_each_repetition,
                    true};
}

void CampaignReview::conclude() {
  if (references_.empty()) return;
  const auto drift = reference_drift(references_);
  if (!drift) {
    progress_.say("drift unknown: too few unflagged steps in the reference runs");
    note_("reference_drift", {{"known", false}});
    return;
  }
  progress_.say(drift->to_words());
  note_("reference_drift", {{"known", true},
                            {"k_begin_n_s2_per_rad2", drift->k_begin},
                            {"k_end_n_s2_per_rad2", drift->k_end},
                            {"share", drift->share},
                            {"u_share", drift->u_share},
                            {"at_equal_air_density", drift->same_air},
                            {"drifted", drift->drifted()}});
}

}  // namespace kphi::daq
