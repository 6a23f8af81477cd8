// libFuzzer: any bytes are a coefficient file, or are refused; what is accepted can be judged, exported and flown.
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/error.hpp"
#include "compensation/file/plausibility.hpp"
#include "fit/export/targets.hpp"
#include "profiles/vehicle.hpp"
#include "results/checksums.hpp"

namespace {

const kphi::profiles::Vehicle& vehicle() {
  static const kphi::profiles::Vehicle kOnce = [] {
    kphi::profiles::Vehicle made;
    made.half_side = kphi::Metres(0.045);
    made.arm_length = kphi::Metres(0.117);
    made.propeller_radius = kphi::Metres(0.0635);
    made.hinge_turn_deg = {0, 90, 180, 270};
    made.arm_angle_min = kphi::from_degrees(-90);
    made.arm_angle_max = kphi::from_degrees(180);
    made.speed_max = kphi::RadPerSec(2000);
    made.shapes["X"] = kphi::compensation::Rotors<kphi::Radians>(4, kphi::from_degrees(45));
    made.dynamics.emplace();
    made.dynamics->mass_kg = 0.6;
    made.dynamics->hub_mass_kg = 0.045;
    made.dynamics->yaw_arm_m = 0.0133;
    made.dynamics->spin = {1, -1, 1, -1};
    return made;
  }();
  return kOnce;
}

void export_all(const kphi::compensation::Coefficients& coefficients) {
  for (const auto& target : kphi::fit::targets()) {
    for (const kphi::profiles::Vehicle* flown : {static_cast<const kphi::profiles::Vehicle*>(nullptr), &vehicle()}) {
      try {
        (void)target.write(coefficients, {.speed_max_rpm = 19100, .vehicle = flown});
      } catch (const kphi::Error&) {  // a target may refuse; the others are still written
      }
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    kphi::results::require_seal(text, "fuzz.yaml");
    const auto coefficients =
        kphi::compensation::parse_coefficients(text, "fuzz.yaml", kphi::compensation::Need::thrust_coefficient);
    (void)kphi::compensation::doubts_of(coefficients);
    export_all(coefficients);
  } catch (const kphi::compensation::CoefficientError&) {
  } catch (const kphi::Error&) {
  }
  return 0;
}
