// A test that computes leaves the processors to whoever must run when it wakes: see kphi_test() in CMakeLists.txt.
#include <unistd.h>

#include <cstdlib>

namespace kphi::test {
namespace {

[[maybe_unused]] const bool kPolite = std::getenv("KPHI_POLITE") != nullptr && ::nice(19) != -1;

}  // namespace
}  // namespace kphi::test
