// What a campaign will do and need, and what is wrong with it: printed before any device is touched.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/finding.hpp"
#include "compensation/units.hpp"
#include "daq/guard/guard_limits.hpp"
#include "profiles/answers.hpp"
#include "profiles/campaign.hpp"
#include "profiles/plan.hpp"
#include "profiles/thrust_prior.hpp"
#include "results/file_layer.hpp"

namespace kphi::daq {

/// One check of a plan. A note: passed, if it was judged. A fault: the campaign would be refused or stopped.
struct PlanCheck {
  std::string subject;  ///< "speed", "thrust", …
  Finding finding;
  bool judged = true;  ///< false: not checked: it needs a device, or data that are not known
};

struct DryRun {
  profiles::Plan plan;
  std::vector<PlanCheck> checks;
  std::vector<Finding> files;      ///< of the disk, as tried; among the checks, too
  std::vector<GuardLimit> limits;  ///< the guard's, without those of the devices
  std::uint64_t bytes_needed = 0;
  std::uint64_t bytes_free = 0;
  [[nodiscard]] std::ptrdiff_t refused() const;  ///< faults
  [[nodiscard]] bool ok() const { return refused() == 0; }
};

/// With every run that it may have, where repetitions is a range.
[[nodiscard]] profiles::Plan longest_plan(profiles::Campaign campaign, const profiles::BenchConfig& config);
/// Bytes on disk that the runs of a plan take, with a margin.
[[nodiscard]] std::uint64_t bytes_needed(const profiles::Plan& plan, const profiles::BenchConfig& config);

/// Touches no device; tries the disk (results/disk_trial.hpp). `out`: the folder for results, which need not exist.
/// `answers`: if scripted.
[[nodiscard]] DryRun dry_run(const profiles::Campaign& campaign, const profiles::BenchConfig& config,
                             const std::filesystem::path& out, const std::optional<profiles::Answers>& answers,
                             results::FileLayer& files = results::disk());

/// A few lines: the campaign as a whole.
[[nodiscard]] std::string plan_text(const profiles::Campaign& campaign, const profiles::BenchConfig& config,
                                    const profiles::Plan& plan);
/// Everything: the plan, each run in its order, time, disk, every check, and the guard's limits.
[[nodiscard]] std::string to_text(const DryRun& dry, const profiles::Campaign& campaign,
                                  const profiles::BenchConfig& config);
[[nodiscard]] nlohmann::json to_json(const profiles::Plan& plan, const profiles::BenchConfig& config);
[[nodiscard]] nlohmann::json to_json(const DryRun& dry, const profiles::Campaign& campaign,
                                     const profiles::BenchConfig& config);

}  // namespace kphi::daq
