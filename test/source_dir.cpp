#include "test/source_dir.hpp"

namespace kphi::test {

std::string source_dir() { return KPHI_SOURCE_DIR; }

}  // namespace kphi::test
