// What one more run of an occlusion would do to its k.
#pragma once

#include <span>

#include "results/reduction/repetitions.hpp"

namespace kphi::results {

/// How far the next run of an occlusion would move the mean k of its runs, as a share of it: half of the 95 % interval,
/// t s √(1/n − 1/(n + 1)) with the scatter s of single runs about the mean of their occlusion, pooled over `verdicts`.
/// Infinite while no occlusion has two runs, and where this one has none.
[[nodiscard]] double moved_by_next_run(std::span<const RepetitionVerdict> verdicts, double occlusion_deg);

}  // namespace kphi::results
