// Tries in a folder what recording needs, before anything turns: a run that cannot be kept is not measured.
#pragma once

#include <filesystem>
#include <vector>

#include "base/finding.hpp"
#include "results/file_layer.hpp"

namespace kphi::results {

/// Creates a folder of its own below `parent`, which exists, makes and renames files there, and removes it. A fault: no
/// run could be kept. A warning: all is recorded, and what that disk cannot do; at most one of each kind. Empty: it can
/// do all. Takes some milliseconds.
[[nodiscard]] std::vector<Finding> try_disk(const std::filesystem::path& parent, FileLayer& files = disk());

/// Of a lock that `folder` cannot give: a warning.
[[nodiscard]] Finding no_lock(const std::filesystem::path& folder);

}  // namespace kphi::results
