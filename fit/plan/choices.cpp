#include "fit/plan/choices.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "base/error.hpp"
#include "base/json.hpp"
#include "profiles/plan.hpp"
#include "results/reduction/bin_statistics.hpp"

namespace kphi::fit {
namespace {

using Json = nlohmann::ordered_json;
using profiles::Campaign;
using profiles::StepProfile;

constexpr int kLeastRepetitions = 2, kMostRepetitions = 8;
constexpr std::size_t kMostInner = 6;
constexpr double kBendToSee = 0.01;
constexpr double kLongestDwell = 4;  // s, of steps that end by themselves

/// Which occlusions are run: 0°, the ends, and every choice of what lies between.
std::vector<std::vector<double>> occlusion_sets(std::vector<double> all) {
  std::ranges::sort(all);
  std::vector<double> inner;
  for (std::size_t i = 2; i + 1 < all.size(); ++i) inner.push_back(all[i]);
  if (inner.empty() || inner.size() > kMostInner) return {all};
  std::vector<std::vector<double>> sets;
  for (unsigned bits = 1; bits < 1u << inner.size(); ++bits) {
    std::vector<double> set{all[0], all[1]};
    for (std::size_t i = 0; i < inner.size(); ++i)
      if ((bits >> i & 1u) != 0) set.push_back(inner[i]);
    set.push_back(all.back());
    sets.push_back(set);
  }
  return sets;
}

/// Ways to hold the steps: each for a time, and as long as k needs.
std::vector<StepProfile> holdings(const PlanQuestion& question) {
  const StepProfile& written = question.campaign.profile;
  if (written.until) return {written};
  const double first = std::max(question.noise.settle_s, question.campaign.minimum_discard.value());
  const auto seconds = [&](double window) { return std::ceil(10 * (first + window) - 1e-9) / 10; };
  std::set<double> all{written.dwell.value()};
  for (const double window : {results::kLeastWindow, 0.75, 1.0, 1.5, 2.0, 3.0}) all.insert(seconds(window));
  std::vector<StepProfile> ways;
  for (const double dwell_s : all) {
    ways.push_back(written);
    ways.back().dwell = Seconds(dwell_s);
  }
  for (const double k_share : {0.002, 0.0005}) {
    ways.push_back(written);
    ways.back().dwell = Seconds(std::max({kLongestDwell, written.dwell.value(), seconds(1)}));
    ways.back().until = profiles::Until{k_share, Seconds(seconds(results::kLeastWindow))};
  }
  return ways;
}

std::vector<int> step_numbers(const Campaign& campaign) {
  std::set<int> all{campaign.profile.steps};
  for (const int steps : {10, 14, 20, 28}) all.insert(std::min(steps, campaign.profile.steps));
  return {all.begin(), all.end()};
}

void add_cost(const PlanQuestion& question, Choice& choice) {
  const profiles::Plan plan = profiles::make_plan(as_expected(choice.campaign, question.noise), question.bench);
  choice.bench_min = plan.bench.value() / 60;
  choice.mountings = plan.mountings;
  choice.mounting_min = question.minutes_per_mounting * plan.mountings;
  choice.runs = static_cast<int>(plan.runs.size());
  if (question.bytes) choice.bytes = question.bytes(plan);
}

/// `expected`: how the steps of this campaign are expected to be held. Without its cost.
Choice predicted(const PlanQuestion& question, const std::vector<Wanted>& told, Campaign campaign,
                 const StepProfile& expected) {
  Choice choice;
  const StepProfile written = std::exchange(campaign.profile, expected);
  const Prediction prediction(campaign, question.noise, question.uncertainty, question.curve);
  for (const Wanted& wanted : told) choice.told.push_back(prediction.of(wanted));
  choice.bend_seen = prediction.bend_seen();
  choice.campaign = std::move(campaign);
  choice.campaign.profile = written;
  return choice;
}

bool fulfils(const PlanQuestion& question, const Choice& choice, double bend) {
  for (std::size_t i = 0; i < question.wishes.size(); ++i)
    if (!(share_of(choice.told[i]) <= question.wishes[i].share)) return false;
  return !(choice.bend_seen > bend);
}

/// A way to hold the steps of a run.
struct Steps {
  StepProfile profile, expected;  ///< as the file says, and as they are expected to be held
  double run_s = 0;               ///< motor on, for one run
};

std::vector<Steps> ways_to_step(const PlanQuestion& question) {
  std::vector<Steps> ways;
  Campaign campaign = question.campaign;
  for (const int steps : step_numbers(question.campaign)) {
    for (const StepProfile& way : holdings(question)) {
      campaign.profile = way;
      campaign.profile.steps = steps;
      const StepProfile expected = as_expected(campaign, question.noise).profile;
      const int back = campaign.order.steps == profiles::StepOrderKind::up_and_down ? 2 : 1;
      ways.push_back({campaign.profile, expected, expected.steps * expected.dwell.value() * back});
    }
  }
  return ways;
}

/// A campaign to look at, with what it costs before anything of it is predicted. There are ten thousands of them.
struct Candidate {
  const std::vector<double>* occlusions_deg = nullptr;
  const Steps* steps = nullptr;
  double zero_s = 0;
  int repetitions = 0;
  bool remounts = false;
  double minutes = 0;

  /// Of each kind the cheapest is of interest.
  [[nodiscard]] auto kind() const { return std::pair(occlusions_deg, remounts); }
  [[nodiscard]] auto but_for_repetitions() const { return std::tuple(occlusions_deg, remounts, steps, zero_s); }
  [[nodiscard]] Campaign in(Campaign campaign) const {
    campaign.occlusions_deg = *occlusions_deg;
    campaign.profile = steps->profile;
    campaign.zero = Seconds(zero_s);
    campaign.repetitions = repetitions;
    campaign.repetitions_most.reset();
    campaign.order.remount_each_repetition = remounts;
    return campaign;
  }
};

/// Cheapest first; they point into `sets` and `ways`.
std::vector<Candidate> candidates(const PlanQuestion& question, const std::vector<std::vector<double>>& sets,
                                  const std::vector<Steps>& ways) {
  const int zeros_of_run = question.campaign.box_bias ? 4 : 2, references = question.campaign.order.reference ? 2 : 0;
  std::vector<Candidate> all;
  for (const std::vector<double>& occlusions_deg : sets)
    for (const bool remounts : {false, true})
      for (int repetitions = kLeastRepetitions; repetitions <= kMostRepetitions; ++repetitions)
        for (const Steps& steps : ways)
          for (const double zero_s : std::set<double>{question.campaign.zero.value(), 1, 2, 4}) {
            const int runs = repetitions * static_cast<int>(occlusions_deg.size()) + references;
            const int mountings = remounts ? runs : static_cast<int>(occlusions_deg.size());
            const double minutes =
                runs * (steps.run_s + zeros_of_run * zero_s) / 60 + mountings * question.minutes_per_mounting;
            all.push_back({&occlusions_deg, &steps, zero_s, repetitions, remounts, minutes});
          }
  std::ranges::stable_sort(all, {}, &Candidate::minutes);
  return all;
}

/// The campaign that knows most: everything as often and as long as it is looked at.
Choice largest(const PlanQuestion& question, const std::vector<Wanted>& told) {
  Campaign campaign = question.campaign;
  campaign.repetitions = std::max(kMostRepetitions, campaign.repetitions);
  campaign.order.remount_each_repetition = true;
  campaign.profile.dwell = Seconds(std::ranges::max(holdings(question), {}, [](const StepProfile& way) {
                                     return way.until ? 0 : way.dwell.value();
                                   }).dwell.value());
  campaign.zero = Seconds(std::max(4.0, campaign.zero.value()));
  return predicted(question, told, campaign, campaign.profile);
}

std::string row_words(const Budget& budget) {
  const BudgetRow* row = largest_row(budget);
  if (row == nullptr) return "nothing known";
  return fmt::format("{} ({:.0f} % of the variance){}{}", row->source, 100 * budget.share(*row),
                     row->remedy.empty() ? "" : ": ", row->remedy);
}

std::string occlusion_words(const Campaign& campaign) {
  return fmt::format("{:g}", fmt::join(campaign.occlusions_deg, " "));
}

std::string share_words(double share) { return std::isfinite(share) ? in_percent(share) + " %" : "none"; }

/// Of all choices, so that a table is as wide as it must be.
std::size_t widest_occlusions(const PlanAnswer& answer) {
  std::size_t width = occlusion_words(answer.as_written.campaign).size();
  for (const Choice& choice : answer.choices) width = std::max(width, occlusion_words(choice.campaign).size());
  return width;
}

std::string choice_line(const std::string& name, const Choice& choice, std::size_t occlusions_width) {
  const Campaign& one = choice.campaign;
  const char* most = one.profile.until ? "≤" : "";
  std::string line =
      fmt::format("{:<7} {:>6.1f} {:>6} {:>4} {:>5.2f}  {} x {:<{}} {:>3} x {:<6} {:>5}", name, choice.minutes(),
                  choice.mountings, choice.runs, 1e-9 * static_cast<double>(choice.bytes), one.repetitions,
                  occlusion_words(one), occlusions_width, fmt::format("{}{}", most, one.profile.steps),
                  fmt::format("{}{:g} s", most, one.profile.dwell.value()), fmt::format("{:g} s", one.zero.value()));
  for (const Budget& budget : choice.told) line += fmt::format(" {:>9}", share_words(share_of(budget)));
  return line + fmt::format(" {:>7}\n", share_words(choice.bend_seen));
}

Json to_json(const Choice& choice) {
  const Campaign& one = choice.campaign;
  Json told = Json::array();
  for (const Budget& budget : choice.told) {
    const BudgetRow* row = largest_row(budget);
    told.push_back({{"quantity", budget.quantity},
                    {"value", budget.value},
                    {"expanded_95", budget.expanded()},
                    {"share_95", share_of(budget)},
                    {"u", budget.combined()},
                    {"freedom", budget.freedom()},
                    {"limited_by", row == nullptr ? Json(nullptr) : Json(row->source)},
                    {"not_known", budget.not_known()},
                    {"assumed", budget.assumed()}});
  }
  const auto& until = one.profile.until;
  return {{"minutes", choice.minutes()},
          {"bench_min", choice.bench_min},
          {"mountings", choice.mountings},
          {"runs", choice.runs},
          {"bytes", choice.bytes},
          {"occlusions_deg", one.occlusions_deg},
          {"repetitions", one.repetitions},
          {"remount_each_repetition", one.order.remount_each_repetition},
          {"steps", one.profile.steps},
          {"dwell_s", one.profile.dwell.value()},
          {"dwell_least_s", until ? Json(until->dwell_least.value()) : Json(nullptr)},
          {"until_k_percent", until ? Json(100 * until->k_share) : Json(nullptr)},
          {"zero_s", one.zero.value()},
          {"bend_seen_share", std::isfinite(choice.bend_seen) ? Json(choice.bend_seen) : Json(nullptr)},
          {"told", told}};
}

}  // namespace

PlanAnswer answer(const PlanQuestion& question) {
  PlanAnswer result;
  for (const Wish& wish : question.wishes) result.told.push_back(wish.of);
  if (result.told.empty()) result.told = usual_wants(question.campaign);
  result.as_written = predicted(question, result.told, question.campaign, question.campaign.profile);
  add_cost(question, result.as_written);
  if (question.wishes.empty()) return result;

  const Choice most = largest(question, result.told);
  for (std::size_t i = 0; i < question.wishes.size(); ++i)
    if (!(share_of(most.told[i]) <= question.wishes[i].share))
      result.unreachable.push_back({question.wishes[i], share_of(most.told[i]), row_words(most.told[i])});
  if (!result.unreachable.empty()) return result;

  const double bend = std::max(kBendToSee, result.as_written.bend_seen);
  const auto sets = occlusion_sets(question.campaign.occlusions_deg);
  const auto ways = ways_to_step(question);
  std::set<std::pair<const std::vector<double>*, bool>> found;
  std::map<std::tuple<const std::vector<double>*, bool, const Steps*, double>, bool> by_repeating;  // fulfilled at all
  Campaign textless = question.campaign;
  textless.text.clear();  // not copied for every candidate
  for (const Candidate& candidate : candidates(question, sets, ways)) {
    if (found.contains(candidate.kind())) continue;
    const auto predict = [&](const Candidate& one) {
      return predicted(question, result.told, one.in(textless), one.steps->expected);
    };
    const auto [enough, is_new] = by_repeating.try_emplace(candidate.but_for_repetitions(), true);
    if (is_new) {
      Candidate often = candidate;
      often.repetitions = kMostRepetitions;
      enough->second = fulfils(question, predict(often), bend);
    }
    if (!enough->second) continue;
    Choice choice = predict(candidate);
    if (!fulfils(question, choice, bend)) continue;
    choice.campaign.text = question.campaign.text;
    add_cost(question, choice);
    result.choices.push_back(std::move(choice));
    found.insert(candidate.kind());
    if (result.choices.size() == kMostChoices) break;
  }
  return result;
}

std::string answer_text(const PlanQuestion& question, const PlanAnswer& answer) {
  const std::size_t width = widest_occlusions(answer);
  std::string text = fmt::format("{:<7} {:>6} {:>6} {:>4} {:>5}  {:<{}} {:<12} {:>5}", "", "min", "mounts", "runs",
                                 "GB", "occlusions, °", width + 4, "speeds", "zero");
  for (const Wanted& wanted : answer.told) text += fmt::format(" {:>9}", wanted.name() + " ±");
  text += fmt::format(" {:>7}\n", "bend");
  text += choice_line("written", answer.as_written, width);
  for (std::size_t i = 0; i < answer.choices.size(); ++i)
    text += choice_line(fmt::format("{}", i + 1), answer.choices[i], width);
  text += fmt::format(
      "\n±     half of the expected 95 % interval\nmin   with {:g} for each mounting; as many mounts as runs: each run "
      "is "
      "mounted anew\nbend  of k(φ), share of K_T, that the test of the line finds in about 19 of 20 campaigns\n",
      question.minutes_per_mounting);
  for (std::size_t i = 0; i < answer.told.size(); ++i)
    text +=
        fmt::format("{:<5} as written is limited by {}\n", answer.told[i].name(), row_words(answer.as_written.told[i]));
  const std::vector<std::string> assumed = answer.as_written.told.front().assumed();
  if (!assumed.empty())
    text += fmt::format("assumed in ±, since not measured: {} (see `--u`)\n", fmt::join(assumed, ", "));
  for (const Unreachable& one : answer.unreachable)
    text +=
        fmt::format("{} {}: not to be reached here; {} remain with {} repetitions, limited by {}\n", one.wish.of.name(),
                    share_words(one.wish.share), share_words(one.best), kMostRepetitions, one.because);
  return text;
}

std::string answer_json(const PlanQuestion& question, const PlanAnswer& answer) {
  Json noise, choices = Json::array(), unreachable = Json::array();
  for (const auto& [name, value] : known_noise(question.noise)) noise[name] = value;
  for (const Choice& choice : answer.choices) choices.push_back(to_json(choice));
  for (const Unreachable& one : answer.unreachable)
    unreachable.push_back({{"quantity", one.wish.of.name()},
                           {"wanted_share_95", one.wish.share},
                           {"best_share_95", one.best},
                           {"because", one.because}});
  const Json json{{"campaign", question.campaign.name},
                  {"stand", noise},
                  {"minutes_per_mounting", question.minutes_per_mounting},
                  {"as_written", to_json(answer.as_written)},
                  {"choices", choices},
                  {"unreachable", unreachable}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace kphi::fit
