// A campaign file with some of its values replaced, everything else as its author wrote it: comments, order, layout.
#pragma once

#include <string>

#include "profiles/campaign.hpp"

namespace kphi::profiles {

/// The text of `campaign` with occlusions, repetitions, remounting, number of steps, dwell, zero and name of `wanted`.
/// Values that are the same stay as they are written. Throws ConfigurationError where the text cannot hold them.
[[nodiscard]] std::string changed_text(const Campaign& campaign, const Campaign& wanted);

}  // namespace kphi::profiles
