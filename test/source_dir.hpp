// Where the project's sources lie, for tests that read files of the tree.
#pragma once

#include <string>

namespace kphi::test {

/// Absolute, without a slash at the end. Known to one object file only, so that all others compile alike in any folder.
[[nodiscard]] std::string source_dir();

}  // namespace kphi::test
