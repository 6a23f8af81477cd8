// Any bytes as the box's answer over TCP: none, or one whose scale can be compared with any configuration.
#include <cmath>
#include <cstdlib>

#include "drivers/netbox/configuration/calinfo.hpp"
#include "test/fuzz/tokens.hpp"

namespace {

/// The manual's example.
constexpr std::string_view kExample{
    "\x12\x34\x02\x03\x00\x0f\x42\x40\x00\x0f\x42\x40\x04\xc5\x04\xc5\x0e\x4e\x00\x3d\x00\x3d\x00\x3d", 24};
constexpr std::string_view kTokens[] = {kExample, kExample.substr(0, 2), kExample.substr(4, 4)};

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  return kphi::test::mutate_with(kTokens, data, size, max, seed);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kphi::netbox;
  const auto calinfo = decode_calinfo({data, size});
  require(calinfo.has_value() == (size == kCalinfoBytes && data[0] == 0x12 && data[1] == 0x34));
  if (!calinfo) return 0;
  Configuration configuration;
  configuration.counts_per_newton = configuration.counts_per_newton_metre = 1e6;
  const auto finding = compare(*calinfo, configuration);
  const bool same = calinfo->force_unit == 2 && calinfo->torque_unit == 3 && calinfo->counts_per_force == 1'000'000 &&
                    calinfo->counts_per_torque == 1'000'000;
  if (same) require(!finding);
  if (calinfo->counts_per_force == 0) require(finding.has_value());
  return 0;
}
