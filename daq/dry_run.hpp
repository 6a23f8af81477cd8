// What a campaign will do and need, and whether it may: said before anything is touched.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "drivers/finding.hpp"
#include "profiles/answers.hpp"
#include "profiles/plan.hpp"
#include "results/file_layer.hpp"

namespace kphi::daq {

/// One limit that was looked at. A note: within it, if it was judged. A fault: the campaign would be refused or
/// stopped.
struct LimitCheck {
  std::string subject;  ///< "speed", "thrust", …
  Finding finding;
  bool judged = true;  ///< false: only a device can tell, or nobody
};

struct DryRun {
  profiles::Plan plan;
  std::vector<LimitCheck> checks;
  std::uint64_t bytes_needed = 0;
  std::uint64_t bytes_free = 0;
  [[nodiscard]] bool ok() const;
};

/// Bytes on disk that the runs of a plan take, with a margin.
[[nodiscard]] std::uint64_t bytes_needed(const profiles::Plan& plan, const profiles::Bench& place);

/// Touches no device. `out`: the folder for results, which need not be there. `answers`: if any are scripted.
[[nodiscard]] DryRun dry_run(const profiles::Campaign& campaign, const profiles::Bench& place,
                             const std::filesystem::path& out, const std::optional<profiles::Answers>& answers,
                             results::FileLayer& files = results::disk());

/// A few lines: the campaign as a whole.
[[nodiscard]] std::string plan_text(const profiles::Campaign& campaign, const profiles::Bench& place,
                                    const profiles::Plan& plan);
/// Everything: the whole, each run in its order, time, disk, and every limit.
[[nodiscard]] std::string to_text(const DryRun& dry, const profiles::Campaign& campaign, const profiles::Bench& place);
[[nodiscard]] nlohmann::json to_json(const DryRun& dry, const profiles::Campaign& campaign,
                                     const profiles::Bench& place);

}  // namespace kphi::daq
