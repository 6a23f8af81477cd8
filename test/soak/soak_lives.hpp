// A campaign through all its lives: whatever ended one of them, somebody may go on with what it left.
#pragma once

#include <cstdint>
#include <functional>

#include "test/soak/soak_verdict.hpp"

namespace kphi::soak {

/// Lives the campaign of `seed` and judges it; then, as long as nothing is wrong, resumes it: always when it was killed
/// or its disk had refused, now and then after another end, until it is finished or four times in all. `judged` is
/// called for each life. Deterministic.
void live_through(std::uint64_t seed, const std::function<void(const Evidence&, const Verdict&)>& judged);

}  // namespace kphi::soak
