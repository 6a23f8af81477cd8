// What a campaign means in runs, minutes and bytes, before anything turns.
#pragma once

#include <cstdint>
#include <vector>

#include "profiles/bench.hpp"
#include "profiles/campaign.hpp"

namespace kphi::profiles {

/// One Net Box sample on disk: six int32 counts, three uint32 (two sequences, status), one int64 stamp.
inline constexpr std::uint64_t kBytesPerSample = 44;

struct PlannedRun {
  double occlusion_deg = 0;
  int repetition = 1;  ///< 1-based
};

struct Plan {
  std::vector<PlannedRun> runs;        ///< all repetitions of an occlusion follow its mounting
  int mountings = 0;                   ///< times that a person changes the occlusion, the first one included
  int steps = 0;                       ///< in all runs
  Seconds spinning;                    ///< motor on
  Seconds bench;                       ///< spinning and zeros; zeros and biases; not: mounting, spinning down
  std::uint64_t samples_in_steps = 0;  ///< Net Box samples at the bench's rate
  std::uint64_t samples = 0;           ///< zeros included
  std::uint64_t bytes = 0;             ///< of the samples
};

[[nodiscard]] Plan make_plan(const Campaign& campaign, const Bench& bench);

/// Throws ConfigurationError, naming both files and both values, if the campaign asks for more speed than the
/// bench's motor may be told.
void require_within(const Campaign& campaign, const Bench& bench);

}  // namespace kphi::profiles
