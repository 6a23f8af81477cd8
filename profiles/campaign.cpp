#include "profiles/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "compensation/file/plausibility.hpp"
#include "profiles/profile_reader.hpp"

namespace kphi::profiles {

// The schema lists the same words.
NLOHMANN_JSON_SERIALIZE_ENUM(RunOrderKind, {{RunOrderKind::listed, "listed"}, {RunOrderKind::shuffled, "shuffled"}})
NLOHMANN_JSON_SERIALIZE_ENUM(StepOrderKind, {{StepOrderKind::up, "up"},
                                             {StepOrderKind::down, "down"},
                                             {StepOrderKind::shuffled, "shuffled"},
                                             {StepOrderKind::up_and_down, "up_and_down"}})

namespace {

void check_speeds(ProfileReader& file) {
  const double most = file.number("/limits/speed_max_rpm");
  for (const char* end : {"/profile/first_rpm", "/profile/last_rpm"}) {
    if (file.number(end) <= most) continue;
    file.refuse(end, fmt::format("{} is above {} RPM (limits.speed_max_rpm)", file.number(end), most),
                "lower it, or raise the limit if propeller and motor tolerate it");
  }
}

void check_occlusions(ProfileReader& file, const std::vector<double>& occlusions_deg) {
  for (std::size_t i = 1; i < occlusions_deg.size(); ++i) {
    const auto first = std::ranges::find(occlusions_deg, occlusions_deg[i]) - occlusions_deg.begin();
    if (static_cast<std::size_t>(first) < i)
      file.refuse(fmt::format("/occlusions_deg/{}", i),
                  fmt::format("{}° is already listed at [{}]", occlusions_deg[i], first),
                  "list each occlusion once; repetitions sets how often it is run");
  }
}

bool has_range(const ProfileReader& file) { return file.has("/profile/dwell_s/0"); }
std::string shortest_dwell(const ProfileReader& file) {
  return has_range(file) ? "/profile/dwell_s/0" : "/profile/dwell_s";
}
std::string longest_dwell(const ProfileReader& file) {
  return has_range(file) ? "/profile/dwell_s/1" : "/profile/dwell_s";
}

/// `until` and a range of dwell_s belong together.
void read_until(ProfileReader& file, StepProfile& profile) {
  const auto percent = file.find<double>("/profile/until/k_percent");
  if (percent) profile.until = Until{*percent / 100, Seconds(file.number(shortest_dwell(file)))};
  if (percent && !has_range(file))
    file.refuse("/profile/dwell_s", "with until, a step lasts between two times",
                "write dwell_s: [least, most], such as [0.7, 4]");
  if (!percent && has_range(file))
    file.refuse("/profile/dwell_s", "a range without until", "add until: {k_percent: 0.2}, or give one time");
  if (has_range(file))
    file.require_above("/profile/dwell_s/1", "/profile/dwell_s/0", " s", "write the shorter time first");
}

/// The number alone, or a range, which belongs to `until`.
void read_repetitions(ProfileReader& file, Campaign& campaign) {
  campaign.repetitions_extra_max = file.get_or<int>("/repetitions_extra_max", campaign.repetitions_extra_max);
  if (!file.has("/repetitions/0")) {
    campaign.repetitions = file.get_or<int>("/repetitions", campaign.repetitions);
    return;
  }
  if (!campaign.profile.until)
    file.refuse("/repetitions", "a range without profile.until", "add until: {k_percent: 0.2}, or give one number");
  if (file.has("/repetitions_extra_max"))
    file.refuse("/repetitions_extra_max", "repetitions is a range, which says how many at most", "remove one of them");
  file.require_above("/repetitions/1", "/repetitions/0", "", "write the smaller number first");
  campaign.repetitions = file.get<int>("/repetitions/0");
  campaign.repetitions_most = file.get<int>("/repetitions/1");
  campaign.repetitions_extra_max = *campaign.repetitions_most - campaign.repetitions;
}

Order read_order(ProfileReader& file) {
  Order order;
  order.runs = file.get_or("/order/runs", order.runs);
  order.steps = file.get_or("/order/steps", order.steps);
  order.seed = file.get_or<std::uint64_t>("/order/seed", order.seed);
  order.remount_each_repetition = file.get_or("/order/remount_each_repetition", order.remount_each_repetition);
  order.reference = file.get_or("/order/reference", order.reference);
  for (const char* shuffled : {"/order/runs", "/order/steps"}) {
    if (file.has("/order/seed") || file.get_or<std::string>(shuffled, "") != "shuffled") continue;
    file.refuse(shuffled, "shuffled without a seed",
                "add seed: and any whole number; the same seed gives the same order");
  }
  return order;
}

}  // namespace

std::vector<RadPerSec> StepProfile::levels() const {
  std::vector<RadPerSec> levels;
  for (int i = 0; i < steps; ++i) {
    const double share = steps > 1 ? static_cast<double>(i) / (steps - 1) : 0.0;
    levels.emplace_back(std::lerp(first.value(), last.value(), share));  // exact at both ends
  }
  return levels;
}

Campaign parse_campaign(const std::string& text, const std::string& path) {
  ProfileReader file(text, path, FileKind::campaign);
  Campaign campaign;
  campaign.name = file.text("/name");
  campaign.operator_name = file.get_or<std::string>("/operator", "");
  campaign.propeller = {file.text("/propeller/id"), file.text("/propeller/name"), file.number("/propeller/diameter_in"),
                        file.get<int>("/propeller/blades")};
  campaign.occlusions_deg = file.get<std::vector<double>>("/occlusions_deg");
  campaign.order = read_order(file);
  campaign.profile = {file.get<int>("/profile/steps"), Seconds(file.number(longest_dwell(file))),
                      from_rpm(file.number("/profile/first_rpm")), from_rpm(file.number("/profile/last_rpm"))};
  read_until(file, campaign.profile);
  read_repetitions(file, campaign);
  if (const auto rpm_s = file.find<double>("/profile/slew_rpm_s"))
    campaign.profile.slew_rad_s2 = from_rpm(*rpm_s).value();
  campaign.zero = Seconds(file.number("/zero_s"));
  campaign.box_bias = file.get_or("/box_bias", campaign.box_bias);
  campaign.minimum_discard = Seconds(file.number("/minimum_discard_s"));
  campaign.limits = read_limits(file, "/supply_v");
  campaign.supply = Volts(file.number("/supply_v"));
  campaign.text = text;
  campaign.path = path;
  check_speeds(file);
  file.require_above(shortest_dwell(file), "/minimum_discard_s", " s", "dwell longer, or nothing is left to average");
  check_occlusions(file, campaign.occlusions_deg);
  file.finish();
  return campaign;
}

Campaign load_campaign(const std::string& path) { return parse_campaign(read_text(path), path); }

std::vector<std::string> doubts_of(const Campaign& campaign) {
  const std::vector<double>& angles = campaign.occlusions_deg;
  std::vector<std::string> doubts;
  if (const auto radians = compensation::doubt_of_angles(angles)) doubts.push_back(*radians);
  if (std::ranges::find(angles, 0) == angles.end())
    doubts.emplace_back("no occlusion of 0°: without K_T nothing can be fitted for flight; add 0 to occlusions_deg");
  else if (angles.size() == 1)
    doubts.emplace_back("no occlusion but 0°: K_T is fitted, and no k(φ); add occlusions to occlusions_deg");
  return doubts;
}

std::string to_words(const Order& order) {
  const bool seeded = order.runs == RunOrderKind::shuffled || order.steps == StepOrderKind::shuffled;
  const auto word = [](const nlohmann::json& kind) { return kind.get<std::string>(); };
  return fmt::format("runs {}, steps {}{}{}{}", word(order.runs), word(order.steps),
                     seeded ? fmt::format(" (seed {})", order.seed) : "",
                     order.remount_each_repetition ? ", remounted for each repetition" : "",
                     order.reference ? ", reference runs first and last" : "");
}

}  // namespace kphi::profiles
