// libFuzzer: any bytes are a coefficient file, or are refused; what is accepted can be judged, exported and flown.
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/error.hpp"
#include "compensation/file/plausibility.hpp"
#include "fit/export/targets.hpp"
#include "results/checksums.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    kphi::results::require_seal(text, "fuzz.yaml");
    const auto coefficients = kphi::compensation::parse_coefficients(text, "fuzz.yaml");
    (void)kphi::compensation::doubts_of(coefficients);
    for (const auto& target : kphi::fit::targets()) (void)target.write(coefficients, {.speed_max_rpm = 19100});
  } catch (const kphi::compensation::CoefficientError&) {
  } catch (const kphi::Error&) {
  }
  return 0;
}
