#include "profiles/plan.hpp"

#include <fmt/format.h>

#include <cmath>

#include "profiles/strict_yaml.hpp"

namespace kphi::profiles {
namespace {

std::uint64_t samples_in(Seconds time, double rate_hz) {
  return static_cast<std::uint64_t>(std::llround(time.value() * rate_hz));
}

/// "path:line:column"; the path alone if there is no text to look in.
std::string place(const std::string& path, const std::string& text, const std::string& pointer) {
  if (text.empty()) return path;
  const Mark mark = parse_strict_yaml(text, path).value_mark(pointer);
  return fmt::format("{}:{}:{}", path, mark.line, mark.column);
}

}  // namespace

Plan make_plan(const Campaign& campaign, const Bench& bench) {
  Plan plan;
  for (const double occlusion_deg : campaign.occlusions_deg) {
    for (int repetition = 1; repetition <= campaign.repetitions; ++repetition) {
      plan.runs.push_back({occlusion_deg, repetition});
    }
  }
  const auto runs = static_cast<int>(plan.runs.size());
  plan.mountings = static_cast<int>(campaign.occlusions_deg.size());
  plan.steps = runs * campaign.profile.steps;
  plan.spinning = campaign.profile.dwell * plan.steps;
  plan.bench = plan.spinning + campaign.zero * ((campaign.box_bias ? 4.0 : 2.0) * runs);
  plan.samples_in_steps = samples_in(plan.spinning, bench.netbox.rate_hz);
  plan.samples = samples_in(plan.bench, bench.netbox.rate_hz);
  plan.bytes = plan.samples * kBytesPerSample;
  return plan;
}

void require_within(const Campaign& campaign, const Bench& bench) {
  const bool last_is_top = campaign.profile.last >= campaign.profile.first;
  const RadPerSec top = last_is_top ? campaign.profile.last : campaign.profile.first;
  if (top <= bench.iq.speed_max) return;
  const std::string key = last_is_top ? "last_rpm" : "first_rpm";
  throw ConfigurationError(fmt::format(
      "{}: profile.{}: {:.6g} RPM is above {:.6g} RPM, the motor's iq.speed_max_rpm ({}); lower the profile "
      "or choose another bench",
      place(campaign.path, campaign.text, "/profile/" + key), key, to_rpm(top), to_rpm(bench.iq.speed_max),
      place(bench.path, bench.text, "/iq/speed_max_rpm")));
}

}  // namespace kphi::profiles
